"""The NXT's motor as physics: lag, dead zone, brake or coast, and a wheel that holds or slips on the floor."""

from __future__ import annotations

from math import copysign, floor

DEAD_ZONE_PERCENT = 5
"""PWM that does not overcome the gears' friction. Source: docs/firmware.md section 0.2."""

SPEED_PER_VOLT = 855.0 / 95.0 / 8.0
"""Unloaded speed in deg/s for each percent beyond the dead zone and each volt of the battery: 855 deg/s at 100 % and
8 V. Source: docs/firmware.md section 0.2; LEGO's figure of 170 rpm at 9 V is 6 % more."""

DRIVE_TAU_MS, BRAKE_TAU_MS, COAST_TAU_MS = 60.0, 12.0, 150.0
"""Time constants under PWM, with shorted windings and with open windings. Source: docs/firmware.md section 0.2."""

SPEED_DROP_PER_NM = 1020.0 / 0.5
"""How much slower, in deg/s, a torque of 1 N·m makes the motor: the line between 170 rpm without load and 0.5 N·m when
held. Source: Philippe Hurbain's measurements of the NXT motor at 9 V (philohome.com/nxtmotor)."""

REST_DEG_S = 15.0
"""Below this speed a motor without power stands still: its gears hold it."""


class WheelMotor:
    """A motor with a wheel; a `MotorPlant` of the simulated brick.

    The state is the speed the motor would turn at without load. The world says every few milliseconds, through
    `roll_freely` and `grip`, whether the wheel is loaded: then the shaft follows the ground as far as the tyre's
    friction can force it to, and slips beyond.

    Args:
        battery_mv: Speed is proportional to it.
        strength: Factor on the speed, for motors that differ.

    Attributes:
        free_speed: Speed without load, deg/s.
        angle: Angle of the shaft, degrees, positive when power is positive.
    """

    __slots__ = ("_count", "_ground", "_hold", "_strength", "_targets", "angle", "free_speed")

    def __init__(self, battery_mv: int = 8000, strength: float = 1.0) -> None:
        self.free_speed = self.angle = 0.0
        self._count = 0
        self._ground: float | None = None
        self._hold = 0.0
        self._strength = strength
        self.set_battery(battery_mv)

    def set_battery(self, battery_mv: int) -> None:
        """Change the voltage; the speed is proportional to it."""
        slope = SPEED_PER_VOLT * battery_mv / 1000.0 * self._strength
        # indexed by a signed byte: Python counts negative indices from the end, which is just what is wanted
        self._targets = [_target(power if power < 128 else power - 256, slope) for power in range(256)]

    @property
    def at_rest(self) -> bool:
        """Whether stepping it without power would change nothing."""
        return self.free_speed == 0.0

    def step(self, pwm: int, brake: bool) -> int:
        """Run one millisecond.

        Args:
            pwm: Percent, -128..127; saturates at 100.
            brake: Whether the windings are shorted while `pwm` is 0.

        Returns:
            New tacho counts, whole degrees.
        """
        speed = self.free_speed
        if pwm:
            speed += (self._targets[pwm] - speed) / DRIVE_TAU_MS
        elif speed:
            speed -= speed / (BRAKE_TAU_MS if brake else COAST_TAU_MS)
            if -REST_DEG_S < speed < REST_DEG_S:
                speed = 0.0
        else:
            return 0
        self.free_speed = speed
        if self._ground is not None:
            slip = speed - self._ground
            hold = self._hold
            speed = self._ground if -hold <= slip <= hold else speed - copysign(hold, slip)
        self.angle = angle = self.angle + speed * 0.001
        count = floor(angle)
        counts = count - self._count
        self._count = count
        return counts

    def roll_freely(self) -> None:
        """From now on nothing but its own inertia loads the wheel."""
        self._ground = None

    @property
    def gripped(self) -> bool:
        """Whether the floor loads the wheel."""
        return self._ground is not None

    def grip(self, ground_deg_s: float, torque_nm: float) -> None:
        """From now on the wheel rubs on a floor that passes by.

        Args:
            ground_deg_s: Speed of the floor under the wheel, as speed of the shaft.
            torque_nm: Torque on the shaft at which the tyre slips.
        """
        self._ground = ground_deg_s
        self._hold = torque_nm * SPEED_DROP_PER_NM


def _target(power: int, slope: float) -> float:
    drive = min(abs(power), 100) - DEAD_ZONE_PERCENT
    return copysign(max(0.0, drive * slope), power)
