"""Physics of the NXT's motor: lag, dead zone, brake or coast, and a wheel that grips or slips."""

from __future__ import annotations

from math import copysign, floor

DEAD_ZONE_PERCENT = 5
"""PWM below which the gears' friction holds the shaft. Source: docs/firmware.md section 0.2."""

SPEED_PER_VOLT = 855.0 / 95.0 / 8.0
"""Unloaded speed in deg/s for each percent beyond the dead zone and each volt of the battery: 855 deg/s at 100 % and
8 V. Source: docs/firmware.md section 0.2; LEGO's figure of 170 rpm at 9 V is 6 % more."""

DRIVE_TAU_MS, BRAKE_TAU_MS, COAST_TAU_MS = 60.0, 12.0, 150.0
"""Time constants under PWM, with shorted windings and with open windings. Source: docs/firmware.md section 0.2."""

SPEED_DROP_PER_NM = 1020.0 / 0.5
"""Loss of speed in deg/s per N·m of torque: the line between 170 rpm without load and 0.5 N·m at stall. Source:
Philippe Hurbain's measurements of the NXT motor at 9 V (philohome.com/nxtmotor)."""

FREE_CURRENT_A, STALL_CURRENT_A = 0.06, 2.0
"""Current without load and at stall. Source: Philippe Hurbain's measurements of the NXT motor at 9 V."""

REST_DEG_S = 15.0
"""Below this speed a motor without power stops: its gears hold it."""


class WheelMotor:
    """A motor with a wheel; a `MotorPlant` of the simulated brick.

    The state is the speed the motor would have without load. Every few milliseconds the world sets the load through
    `unload` and `load`: under load the shaft follows the ground up to the limit of the tyre's friction, and slips
    beyond it.

    Args:
        battery_mv: Battery voltage; the speed is proportional to it.
        strength: Factor on the speed, for differences between motors.
        dead_zone_percent: PWM below which friction holds the shaft.

    Attributes:
        free_speed: Speed without load, deg/s.
        angle: Angle of the shaft, degrees, positive when power is positive.
        pwm: Power of the last millisecond, percent.
        plugged: Whether its cable is plugged in; without it the motor gets no power and its turns are not counted.
    """

    __slots__ = (
        "_battery_mv",
        "_count",
        "_dead_zone",
        "_drag",
        "_ground",
        "_hold",
        "_strength",
        "_targets",
        "angle",
        "free_speed",
        "plugged",
        "pwm",
    )

    def __init__(
        self, battery_mv: int = 8000, strength: float = 1.0, dead_zone_percent: int = DEAD_ZONE_PERCENT
    ) -> None:
        self.free_speed = self.angle = 0.0
        self._count = 0
        self._ground: float | None = None
        self._hold = 0.0
        self._strength, self._dead_zone, self._drag = strength, dead_zone_percent, 0.0
        self.pwm = 0
        self.plugged = True
        self.set_battery(battery_mv)

    def set_battery(self, battery_mv: int) -> None:
        """Change the voltage; the speed is proportional to it."""
        self._battery_mv = battery_mv
        slope = SPEED_PER_VOLT * battery_mv / 1000.0 * self._strength
        speeds = [max(0.0, (power - self._dead_zone) * slope - self._drag) for power in range(101)]
        top = speeds[100]
        # indexed by a signed byte: negative indices count from the end
        self._targets = [*speeds, *[top] * 27, *[-top] * 28, *(-speed for speed in speeds[:0:-1])]

    def drag(self, torque_nm: float) -> None:
        """Load the shaft with a constant torque, such as the pile of a carpet."""
        drag = torque_nm * SPEED_DROP_PER_NM
        if drag != self._drag:
            self._drag = drag
            self.set_battery(self._battery_mv)

    @property
    def current_a(self) -> float:
        """Current that the motor draws from the battery, A: more the further it is from its speed without load."""
        if not self.pwm:
            return 0.0
        speed, top = self.free_speed if self._ground is None else self._ground, self._targets[100]
        behind = abs(self._targets[self.pwm] - speed) / top if top else 1.0  # too weak for its load, it stalls
        return FREE_CURRENT_A + min(1.0, behind) * STALL_CURRENT_A

    @property
    def at_rest(self) -> bool:
        """Whether a step without power changes nothing."""
        return self.free_speed == 0.0

    def step(self, pwm: int, brake: bool) -> int:
        """Run one millisecond.

        Args:
            pwm: Percent, -128..127; saturates at 100.
            brake: Whether the windings are shorted while `pwm` is 0.

        Returns:
            New tacho counts, whole degrees.
        """
        if not self.plugged:
            pwm, brake = 0, False
        speed = self.free_speed
        self.pwm = pwm
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
        return counts if self.plugged else 0

    def unload(self) -> None:
        """Remove the load from the wheel."""
        self._ground = None

    @property
    def loaded(self) -> bool:
        """Whether the wheel is loaded by the floor."""
        return self._ground is not None

    def load(self, ground_deg_s: float, torque_nm: float) -> None:
        """Load the wheel with the friction of the floor.

        Args:
            ground_deg_s: Speed of the floor under the wheel, as shaft speed.
            torque_nm: Shaft torque at which the tyre slips.
        """
        self._ground = ground_deg_s
        self._hold = torque_nm * SPEED_DROP_PER_NM
