"""The deterministic integer motor model with which the golden conversations were recorded.

Source: docs/firmware.md section 0.2.
"""

from __future__ import annotations

from sim_backend.firmware.cint import divide


class BenchMotor:
    """An unloaded motor: first-order lag from PWM to speed, with separate time constants for drive, brake and coast.

    Attributes:
        gain: Speed per percent of PWM, 1/65536 degree per ms; 590 is about 855 deg/s at 100 %.
        tau: Time constant under PWM, ms.
        tau_brake: Time constant with PWM 0 and the brake on, ms.
        tau_coast: Time constant with PWM 0 and the brake off, ms.
        deadband: PWM that does not turn the shaft, percent.
        locked: Whether the shaft is held.
        velocity: 1/65536 degree per ms.
        position: 1/65536 degree.
    """

    __slots__ = ("_reported", "deadband", "gain", "locked", "position", "tau", "tau_brake", "tau_coast", "velocity")

    def __init__(self, gain: int = 590, *, locked: bool = False) -> None:
        self.velocity = self.position = self._reported = 0
        self.configure(gain, 60, 12, 150, 5, locked)

    def configure(self, gain: int, tau: int, tau_brake: int, tau_coast: int, deadband: int, locked: bool) -> None:
        """Change the motor's properties; position and speed stay, except that a locked shaft stops."""
        self.gain, self.tau, self.tau_brake, self.tau_coast = gain, tau, tau_brake, tau_coast
        self.deadband, self.locked = deadband, locked

    @property
    def count(self) -> int:
        """Shaft angle, whole degrees, rounded down."""
        return self.position >> 16

    @property
    def at_rest(self) -> bool:
        """Whether a step without PWM changes nothing."""
        return self.velocity == 0 and self.position >> 16 == self._reported

    def turn(self, degrees: int) -> None:
        """Turn the shaft by hand; the next step reports the counts."""
        self.position += degrees << 16

    def step(self, pwm: int, brake: bool) -> int:
        """Run one millisecond.

        Args:
            pwm: -100..100 percent (the firmware passes on any commanded byte, -128..127).
            brake: Whether the windings are shorted while PWM is off.

        Returns:
            New tacho counts, degrees.
        """
        velocity = self.velocity
        if pwm:
            drive = pwm - self.deadband if pwm > 0 else pwm + self.deadband
            target = drive * self.gain if drive ^ pwm >= 0 else 0
            tau = self.tau
        else:
            target = 0
            tau = self.tau_brake if brake else self.tau_coast
        if self.locked:
            velocity = 0
        elif velocity != target:
            velocity += divide(target - velocity, tau)
            if not target and -tau < velocity < tau:
                velocity = 0
        self.velocity = velocity
        self.position = position = self.position + velocity
        count = position >> 16
        counts = count - self._reported
        self._reported = count
        return counts
