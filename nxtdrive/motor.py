"""A single motor, with Pybricks' names and units: degrees and degrees per second."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from behaviors.ports import Stop
from nxtdrive.outputs import FULL_SPEED_DEG_S, braked, coasting, driven, held, sample
from nxtdrive.ports import MotorPort, in_range, output_port
from nxtdrive.travel import Pace, Travel, Wheel

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

LEASE_S = 1.0
"""A motor that nobody stops goes on for about this time after the program has died."""
RENEWAL_S = 0.4
"""How often a living program renews the lease."""
ACCELERATION_DEG_S2 = 2000.0
"""Of motions to an angle; a free motor reaches full speed within half a second."""
SPEED_WINDOW_S = 0.1
"""Over this time the speed is measured."""
STANDING_DEG_S = 20.0
"""A motor slower than this, though it should run, is stalled."""
FASTEST_DEG_S = 900.0
"""Highest speed that regulation can keep: a fresh battery turns the free motor at about 1000."""


class Then(StrEnum):
    """What a motor does when it has come to its goal."""

    COAST = "coast"
    BRAKE = "brake"
    HOLD = "hold"


class Motor:
    """The motor on one output port.

    `run` and `dc` return at once, and the motor turns until it is told otherwise; it stops by itself when the program
    or the link dies (see `nxtdrive.outputs`), unless something holds it: a blocked motor never uses its lease up. The
    other motions return when they are done, in bounded time.

    Args:
        brick: An open brick.
        port: "A", "B" or "C".
        reversed: Whether the motor is built in the other way round.
    """

    def __init__(self, brick: Brick, port: MotorPort, *, reversed: bool = False) -> None:
        self.port = port
        self._brick = brick
        self._output = output_port(port)
        self._sign = -1 if reversed else 1
        self._zero = 0.0
        self._wanted_deg_s = 0.0

    def dc(self, power: int) -> None:
        """Turn with a duty cycle of -100..100 percent, whatever speed comes of it."""
        in_range("power", power, -100, 100)
        self._start(power, FULL_SPEED_DEG_S, regulated=False)
        self._wanted_deg_s = power / 100 * FULL_SPEED_DEG_S

    def run(self, speed_deg_s: float) -> None:
        """Turn at a regulated speed, -900..900 deg/s, in steps of 10."""
        in_range("speed_deg_s", speed_deg_s, -FASTEST_DEG_S, FASTEST_DEG_S)
        self._start(round(speed_deg_s / FULL_SPEED_DEG_S * 100), abs(speed_deg_s), regulated=True)
        self._wanted_deg_s = speed_deg_s

    def run_time(self, speed_deg_s: float, duration_s: float, then: Then = Then.HOLD) -> None:
        """Turn at `speed_deg_s` for `duration_s`; returns afterwards."""
        in_range("duration_s", duration_s, 0, 3600)
        self.run(speed_deg_s)
        try:
            self._brick.sleep(duration_s)
        finally:
            self._rest(then)

    def run_angle(self, speed_deg_s: float, angle_deg: float, then: Then = Then.HOLD) -> Stop:
        """Turn by `angle_deg` at up to `speed_deg_s`, and return when it is there, to about 2 degrees.

        As in Pybricks, the direction is that of the signs together: both negative is forward.

        Returns:
            DONE, or STALLED or TIMEOUT if something holds the motor.
        """
        in_range("speed_deg_s", abs(speed_deg_s), 10, FASTEST_DEG_S)
        self._forget()
        wheel = Wheel(self._output, self._sign if speed_deg_s > 0 else -self._sign)
        stop = Travel(self._brick, [wheel], Pace(abs(speed_deg_s), ACCELERATION_DEG_S2)).run(angle_deg)
        self._rest(then)
        return stop

    def run_target(self, speed_deg_s: float, target_deg: float, then: Then = Then.HOLD) -> Stop:
        """Turn until `angle` is `target_deg`; otherwise as `run_angle`, and the sign of the speed does not matter."""
        return self.run_angle(abs(speed_deg_s), target_deg - self.angle, then)

    def stop(self) -> None:
        """Switch off; the motor rolls out."""
        self._rest(Then.COAST)

    def brake(self) -> None:
        """Stop now by shorting the motor; it can still be turned by force."""
        self._rest(Then.BRAKE)

    def hold(self) -> None:
        """Stop now and stay: the firmware pushes back whatever turns the motor."""
        self._rest(Then.HOLD)

    @property
    def angle(self) -> float:
        """Angle of the shaft, degrees, since the last `reset_angle`; first since the brick counts."""
        return self._sign * sample(self._brick, self._output).angles_deg[0] - self._zero

    def reset_angle(self, angle_deg: float = 0.0) -> None:
        """Call the present angle `angle_deg`. The brick's own counter goes on: odometry may rest on it."""
        self._zero += self.angle - angle_deg

    @property
    def speed(self) -> float:
        """Speed of the shaft, deg/s, measured over a tenth of a second."""
        before = sample(self._brick, self._output)
        self._brick.sleep(SPEED_WINDOW_S)
        after = sample(self._brick, self._output)
        return self._sign * (after.angles_deg[0] - before.angles_deg[0]) / (after.time_s - before.time_s)

    @property
    def stalled(self) -> bool:
        """Whether the motor stands though `run` or `dc` want it to turn; measured over a tenth of a second."""
        if abs(self._wanted_deg_s) < STANDING_DEG_S:
            return False
        return abs(self.speed) < STANDING_DEG_S

    def _start(self, power: int, speed_deg_s: float, *, regulated: bool) -> None:
        lease_deg = round(max(1.0, speed_deg_s * LEASE_S))
        command = driven(self._output, self._sign * power, lease_deg, regulated=regulated)
        self._brick.moves(self._output)
        self._brick.request(command)
        self._brick.repeat(self.port, command, RENEWAL_S)

    def _rest(self, then: Then) -> None:
        self._forget()
        make = {Then.COAST: coasting, Then.BRAKE: braked, Then.HOLD: held}[then]
        self._brick.request(make(self._output))

    def _forget(self) -> None:
        self._wanted_deg_s = 0.0
        self._brick.forget(self.port)
