"""A single motor, with Pybricks' names and units: degrees and degrees per second."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, overload

from behaviors.ports import StopReason
from firmware_protocol.errors import LocalProtocolError
from nxtdrive.link.link import Link
from nxtdrive.link.scheduler import Motion, Steps
from nxtdrive.motion.lease import LEASE_RANGE_S, LEASE_S
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S, SLOWEST_DEG_S, Sample, braked, coasting, held, sample
from nxtdrive.motion.position_move import PositionMove, SpeedProfile, Wheel
from nxtdrive.motion.stall import STALL_S
from nxtdrive.motion.velocity_move import VelocityMove
from nxtdrive.ports import MotorPort, in_range, of_type, output_port

ACCELERATION_DEG_S2 = 2000.0
"""Default of motions to an angle; a free motor reaches full speed within half a second."""
SPEED_WINDOW_S = 0.1
"""Window for measuring the speed."""
STANDING_DEG_S = 20.0
"""A motor that is slower than this although it should turn is stalled."""
FASTEST_DEG_S = 900.0
"""Highest speed that can be regulated: with a fresh battery a free motor turns at about 1000 deg/s."""
ANGLE_RANGE_DEG = 1_000_000.0
"""A longer motion, of more than a quarter of an hour, is a mistake in the unit."""


class Then(StrEnum):
    """What a motor does at the end of a motion."""

    COAST = "coast"
    BRAKE = "brake"
    HOLD = "hold"


_RESTS = {Then.COAST: coasting, Then.BRAKE: braked, Then.HOLD: held}


@dataclass(frozen=True, slots=True)
class MotorSettings:
    """How a motor moves.

    Attributes:
        speed_deg_s: Highest speed, 10..900; higher speeds are limited to it. Duty cycles are not limited.
        acceleration_deg_s2: How fast the speed changes. None: 2000 in motions to an angle, else as fast as possible.
        lease_s: About how long a motor keeps turning after the program or the link has died, 0.3..10. The lease is an
            angle: what the motor turns in this time at the commanded speed, at least 20 degrees.
        stall_s: A motor that stands for this time although it should turn is braked, 0.3 or more. None: no stall
            detection by `run` and `dc`.
    """

    speed_deg_s: float = FASTEST_DEG_S
    acceleration_deg_s2: float | None = None
    lease_s: float = LEASE_S
    stall_s: float | None = STALL_S

    def __post_init__(self) -> None:
        in_range("speed_deg_s", self.speed_deg_s, SLOWEST_DEG_S, FASTEST_DEG_S)
        in_range("lease_s", self.lease_s, *LEASE_RANGE_S)
        if self.acceleration_deg_s2 is not None:
            in_range("acceleration_deg_s2", self.acceleration_deg_s2, 1, math.inf)
        if self.stall_s is not None:
            in_range("stall_s", self.stall_s, 0.3, math.inf)


SETTINGS = MotorSettings()


class Motor:
    """The motor on one output port.

    `run` and `dc` return at once, and the motor turns until the next command; it stops if the program or the link dies,
    or if it is blocked (docs/motion.md). The other motions take a bounded time. They return when they are done, or with
    ``wait=False`` at once and then continue while the program makes requests or calls `Brick.sleep`. A new command
    cancels the motion in progress.

    Args:
        link: The link to the brick.
        port: "A", "B" or "C".
        reversed: Whether the motor is mounted the other way round.
        settings: How fast it moves, and what stops it.

    Attributes:
        port: As given.
        settings: As given.
    """

    def __init__(
        self, link: Link, port: MotorPort, *, reversed: bool = False, settings: MotorSettings = SETTINGS
    ) -> None:
        self.port = port
        self.settings = of_type("settings", settings, MotorSettings)
        self._link = link
        self._output = output_port(port)
        self._sign = -1 if reversed else 1
        self._zero = 0.0
        self._velocity: VelocityMove | None = None
        self._motion: Motion[StopReason] | None = None

    def dc(self, power: int) -> None:
        """Turn with a duty cycle of -100..100 percent; the speed is not regulated."""
        in_range("power", power, -100, 100)
        self._begin(self._turn(power / 100 * FULL_SPEED_DEG_S, regulated=False))

    def run(self, speed_deg_s: float) -> None:
        """Turn at a regulated speed of -900..900 deg/s, in steps of 10."""
        self._begin(self._turn(self._limited(speed_deg_s), regulated=True))

    @overload
    def run_time(
        self, speed_deg_s: float, duration_s: float, then: Then = Then.HOLD, *, wait: Literal[True] = True
    ) -> StopReason: ...
    @overload
    def run_time(
        self, speed_deg_s: float, duration_s: float, then: Then = Then.HOLD, *, wait: Literal[False]
    ) -> Motion[StopReason]: ...
    def run_time(
        self, speed_deg_s: float, duration_s: float, then: Then = Then.HOLD, *, wait: bool = True
    ) -> StopReason | Motion[StopReason]:
        """Turn at `speed_deg_s` for `duration_s`, 0..3600, then do `then`.

        Returns:
            DONE, or STALLED if the motor is blocked.
        """
        in_range("duration_s", duration_s, 0, 3600)
        speed_deg_s, until_s = self._limited(speed_deg_s), self._link.now() + duration_s
        return self._finish(self._turn(speed_deg_s, regulated=True, until_s=until_s), then, wait)

    @overload
    def run_angle(
        self, speed_deg_s: float, angle_deg: float, then: Then = Then.HOLD, *, wait: Literal[True] = True
    ) -> StopReason: ...
    @overload
    def run_angle(
        self, speed_deg_s: float, angle_deg: float, then: Then = Then.HOLD, *, wait: Literal[False]
    ) -> Motion[StopReason]: ...
    def run_angle(
        self, speed_deg_s: float, angle_deg: float, then: Then = Then.HOLD, *, wait: bool = True
    ) -> StopReason | Motion[StopReason]:
        """Turn by `angle_deg` at up to `speed_deg_s`, accurate to about 2 degrees, then do `then`.

        As in Pybricks, the signs multiply: both negative is forward.

        Returns:
            DONE, or STALLED or TIMEOUT if the motor is blocked.
        """
        in_range("angle_deg", angle_deg, -ANGLE_RANGE_DEG, ANGLE_RANGE_DEG)
        return self._finish(self._position_move(speed_deg_s).steps(angle_deg), then, wait)

    @overload
    def run_target(
        self, speed_deg_s: float, target_deg: float, then: Then = Then.HOLD, *, wait: Literal[True] = True
    ) -> StopReason: ...
    @overload
    def run_target(
        self, speed_deg_s: float, target_deg: float, then: Then = Then.HOLD, *, wait: Literal[False]
    ) -> Motion[StopReason]: ...
    def run_target(
        self, speed_deg_s: float, target_deg: float, then: Then = Then.HOLD, *, wait: bool = True
    ) -> StopReason | Motion[StopReason]:
        """Turn until `angle` is `target_deg`; as `run_angle`, but the sign of the speed is ignored."""
        in_range("target_deg", target_deg, -ANGLE_RANGE_DEG, ANGLE_RANGE_DEG)
        move = self._position_move(abs(in_range("speed_deg_s", speed_deg_s, -FASTEST_DEG_S, FASTEST_DEG_S)))
        start = sample(self._link, self._output)  # the motor may be turning: the angle begins at this reading
        return self._finish(move.steps(target_deg - self._angle_at(start), start), then, wait)

    def stop(self) -> None:
        """Switch off; the motor coasts."""
        self._take()
        self._rest(Then.COAST)

    def brake(self) -> None:
        """Stop now by shorting the motor; it can still be turned by hand."""
        self._take()
        self._rest(Then.BRAKE)

    def hold(self) -> None:
        """Stop now and hold the position: the firmware pushes back when the motor is turned."""
        self._take()
        self._rest(Then.HOLD)

    @property
    def done(self) -> bool:
        """Whether no motion is in progress; `run` and `dc` are done when the motor was stopped, for any reason."""
        return self._motion is None or self._motion.done

    def join(self) -> StopReason:
        """Wait for the end of the last motion; `run` and `dc` end by a stall or by another thread.

        Returns:
            How it ended; DONE if there was none.
        """
        return StopReason.DONE if self._motion is None else self._motion.join()

    @property
    def angle(self) -> float:
        """Angle of the shaft, degrees, since the last `reset_angle`; before the first, by the brick's counter.

        The counter begins again when a program is started or ends, and when the brick is switched off; use
        `reset_angle` then.
        """
        return self._angle_at(sample(self._link, self._output))

    def reset_angle(self, angle_deg: float = 0.0) -> None:
        """Set `angle` to `angle_deg`, up to 1,000,000 either way.

        The brick's own counter is not reset, as odometry may use it.
        """
        self._zero += self.angle - in_range("angle_deg", angle_deg, -ANGLE_RANGE_DEG, ANGLE_RANGE_DEG)

    def speed(self) -> float:
        """Measure the speed of the shaft, deg/s; takes a tenth of a second."""
        before = sample(self._link, self._output)
        self._link.sleep(SPEED_WINDOW_S)
        after = sample(self._link, self._output)
        return self._sign * (after.angles_deg[0] - before.angles_deg[0]) / (after.time_s - before.time_s)

    def stalled(self) -> bool:
        """Return whether the motor stands still, or did until it was braked, although `run` or `dc` should turn it.

        Takes a tenth of a second.
        """
        if self._velocity is None or self._motion is None:
            return False
        if self._motion.done:
            return self._motion.join() is StopReason.STALLED
        if abs(self._velocity.speed_deg_s) < STANDING_DEG_S:
            return False
        return abs(self.speed()) < STANDING_DEG_S

    def _angle_at(self, reading: Sample) -> float:
        return self._sign * reading.angles_deg[0] - self._zero

    def _limited(self, speed_deg_s: float) -> float:
        in_range("speed_deg_s", speed_deg_s, -FASTEST_DEG_S, FASTEST_DEG_S)
        limit = self.settings.speed_deg_s
        return max(-limit, min(limit, speed_deg_s))

    def _turn(self, speed_deg_s: float, *, regulated: bool, until_s: float = math.inf) -> Steps[StopReason]:
        """Turn until `until_s`; the speed changes from that of the motion before."""
        settings, before = self.settings, self._velocity
        acceleration = settings.acceleration_deg_s2 or math.inf
        self._velocity = velocity = VelocityMove(
            self._link, self._output, settings.lease_s, acceleration, settings.stall_s or math.inf
        )
        if before is not None and not self.done:
            velocity.speed_deg_s = before.speed_deg_s
        return velocity.steps(self._sign * speed_deg_s, regulated=regulated, until_s=until_s)

    def _position_move(self, speed_deg_s: float) -> PositionMove:
        """Make a motion to an angle; a negative speed turns it the other way."""
        if abs(in_range("speed_deg_s", speed_deg_s, -FASTEST_DEG_S, FASTEST_DEG_S)) < SLOWEST_DEG_S:
            raise LocalProtocolError(f"speed_deg_s must be at least {SLOWEST_DEG_S:g} either way, not {speed_deg_s!r}.")
        settings = self.settings
        profile = SpeedProfile(abs(self._limited(speed_deg_s)), settings.acceleration_deg_s2 or ACCELERATION_DEG_S2)
        wheel = Wheel(self._output, self._sign if speed_deg_s > 0 else -self._sign)
        stall_s = settings.stall_s or STALL_S
        self._velocity = None
        return PositionMove(self._link, [wheel], profile, lease_s=settings.lease_s, stall_s=stall_s)

    def _begin(self, steps: Steps[StopReason]) -> Motion[StopReason]:
        self._motion = self._link.motions.start([self._output], steps)
        return self._motion

    def _finish(self, steps: Steps[StopReason], then: Then, wait: bool) -> StopReason | Motion[StopReason]:
        if then not in tuple(Then):
            raise LocalProtocolError(f"then must be {', '.join(Then)}, not {then!r}.")
        motion = self._begin(self._resting(steps, then))
        return motion.join() if wait else motion

    def _resting(self, steps: Steps[StopReason], then: Then) -> Steps[StopReason]:
        stop = yield from steps
        if stop is not StopReason.CANCELLED:
            self._rest(then)
        return stop

    def _take(self) -> None:
        """Cancel the motion of this motor."""
        self._link.motions.claim([self._output])
        self._velocity = None

    def _rest(self, then: Then) -> None:
        self._link.cancel_timer(self._output.name)
        if then is not Then.COAST:
            self._link.mark_driven(self._output)  # under power, so it has to be switched off when the program ends
        self._link.request(_RESTS[then](self._output))
