"""Turning one wheel, or two together, by a given angle, from the PC: smoothly, exactly, and over slow links.

The firmware's own tacho limit coasts past its target (docs/firmware.md section 1, fact 12), so the PC decides when to
brake. It accounts for the link: a reading is older than its arrival, and a command acts later than it was sent. The
last stretch is done at a creeping speed, and the moment of braking is computed rather than polled for. The limit of
the lease lies just behind the goal: a computer that falters then overshoots by no more than the motor coasts.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from behaviors.ports import StopReason
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from nxtdrive.link.protocol import MotorLink
from nxtdrive.link.scheduler import Cancelled, Steps
from nxtdrive.motion.brake_predictor import CREEP_DEG_S, BrakePredictor
from nxtdrive.motion.lease import LEASE_S, Lease, brake_all
from nxtdrive.motion.outputs import Sample, sample
from nxtdrive.motion.stall import STALL_S

CREEP_DEG = 15.0
"""Length of the last stretch."""
REGULATION_LAG_S = 0.12
"""How late the regulated motor follows a change of speed: one period of 101 ms and the motor's own lag."""
CYCLE_S = 0.02
"""Shortest time between two looks at the wheels; the regulator itself acts only five times less often."""
TOLERANCE_DEG = 2.0
"""A wheel that stopped this close to its goal stays there."""
CORRECTIONS = 5
"""How often a missed goal is approached again."""
BEHIND_DEG = 3.0
"""The limit lies so far behind the goal, as braking in time ends a motion better than coasting."""
MISSED_DEG = 15.0
"""A wheel that is farther from its goal after that has not come there."""
SYNC_PER_S = 2.5
"""Speed, in deg/s, taken from a wheel for each degree it is ahead of the other."""
SETTLE_S = 0.4
"""Longest wait for a braked wheel to stand still."""


@dataclass(frozen=True, slots=True)
class Wheel:
    """A motor that takes part.

    Attributes:
        port: Where it is plugged in.
        ratio: How far it turns for each degree of the motion, negative: backward; -1..1 without 0.
    """

    port: OutputPort
    ratio: float


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast, as seen by the wheels.

    Attributes:
        speed_deg_s: Cruising speed.
        acceleration_deg_s2: Of speeding up and slowing down.
    """

    speed_deg_s: float
    acceleration_deg_s2: float

    def at(self, done_deg: float, left_deg: float) -> float:
        """Speed after `done_deg` with `left_deg` to go before the creeping begins."""
        creep = min(CREEP_DEG_S, self.speed_deg_s)
        up = math.sqrt(creep**2 + 2 * self.acceleration_deg_s2 * max(0.0, done_deg))
        down = math.sqrt(creep**2 + 2 * self.acceleration_deg_s2 * max(0.0, left_deg))
        return min(self.speed_deg_s, up, down)

    def duration_s(self, angle_deg: float) -> float:
        """Longest time a motion of `angle_deg` should take."""
        return 2.0 + 2.0 * (angle_deg / self.speed_deg_s + 2 * self.speed_deg_s / self.acceleration_deg_s2)


Guard = Callable[[bool], StopReason | None]


def unguarded(_near: bool) -> StopReason | None:
    """A guard that lets everything pass."""
    return None


class PositionMove:
    """One motion of some wheels that begin and end together, each turning in its own ratio.

    Args:
        link: The way to the motors.
        wheels: Which ones take part.
        pace: How fast.
        guard: Asked again and again; what it objects ends the motion. It is told whether the goal is near: the last
            stretch leaves no time for questions to sensors.
        note: Shown every reading.
        lease_s: About how long the wheels go on when it is not renewed.
        stall_s: A wheel that stands this long, though it should turn, ends the motion.
    """

    def __init__(
        self,
        link: MotorLink,
        wheels: Sequence[Wheel],
        pace: Pace,
        *,
        guard: Guard = unguarded,
        note: Callable[[Sample], None] = lambda _: None,
        lease_s: float = LEASE_S,
        stall_s: float = STALL_S,
    ) -> None:
        self._link = link
        self._wheels = wheels
        self._ports = [wheel.port for wheel in wheels]
        self._pace = pace
        self._guard = guard
        self._note = note
        self._goals: list[float] = []
        self._leases = [Lease(link, wheel.port, lease_s) for wheel in wheels]
        self._stall_s = stall_s
        self._cycle_s = CYCLE_S

    def steps(self, angle_deg: float) -> Steps[StopReason]:
        """Turn the wheels by `angle_deg` and brake them, step by step.

        Returns:
            Why it ended: what `guard` said, or DONE, STALLED, CANCELLED, or TIMEOUT: time or tries were not enough.

        Raises:
            LinkError: The brick cannot be reached; it was told to brake if possible, else the lease runs out.
        """
        try:
            return (yield from self._run(angle_deg))
        except Cancelled:
            with contextlib.suppress(LinkError):
                self.brake()
            return StopReason.CANCELLED
        except BaseException:
            with contextlib.suppress(LinkError):
                self.brake()
            raise

    def brake(self) -> None:
        """Stop all wheels now."""
        brake_all(self._leases)

    def _run(self, angle_deg: float) -> Steps[StopReason]:
        start = sample(self._link, *self._ports)
        self._goals = [at + wheel.ratio * angle_deg for at, wheel in zip(start.angles_deg, self._wheels, strict=True)]
        rest = angle_deg
        for _ in range(1 + CORRECTIONS):
            stop = yield from self._approach(rest)
            self.brake()
            rest = yield from self._settle()
            if stop is not None:
                return stop
            if abs(rest) <= TOLERANCE_DEG:
                break
        return StopReason.DONE if abs(rest) <= MISSED_DEG else StopReason.TIMEOUT

    def _approach(self, angle_deg: float) -> Steps[StopReason | None]:
        """Drive until it is time to brake; returns what else ended it."""
        link = self._link
        progress = BrakePredictor(self._stall_s, [abs(wheel.ratio) for wheel in self._wheels])
        deadline = link.now() + self._pace.duration_s(abs(angle_deg))
        near = driven = False
        while True:
            stop = self._guard(near)
            began = link.now()
            reading, rests = self._look()
            progress.note(reading.time_s, rests)
            stop = stop or progress.stalled() or (StopReason.TIMEOUT if began > deadline else None)
            if stop is not None:
                return stop
            brake_at = progress.brake_at(reading.delay_s)
            if (progress.rest and not driven) or brake_at - link.now() > self._cycle_s:
                near, driven = self._drive(progress, rests, reading.delay_s), True
            if brake_at - link.now() <= self._cycle_s:
                if brake_at > link.now():
                    for lease in self._leases:
                        lease.brake_at(brake_at)
                    yield brake_at
                return None
            yield began + CYCLE_S
            self._cycle_s = link.now() - began

    def _look(self) -> tuple[Sample, list[float]]:
        """The wheels, and how far each still has to go in its own direction."""
        reading = sample(self._link, *self._ports)
        self._note(reading)
        rests = [
            (goal - at) / wheel.ratio
            for wheel, goal, at in zip(self._wheels, self._goals, reading.angles_deg, strict=True)
        ]
        return reading, rests

    def _drive(self, progress: BrakePredictor, rests: list[float], delay_s: float) -> bool:
        """Set each wheel's speed by the profile, and keep the wheels together; returns whether the goal is near."""
        creeping = CREEP_DEG + CREEP_DEG_S * (delay_s + self._cycle_s)
        ahead = progress.speed * (delay_s + REGULATION_LAG_S)
        left = abs(progress.rest) - ahead - creeping
        speed = self._pace.at(progress.done, left)
        for number, (wheel, lease, rest) in enumerate(zip(self._wheels, self._leases, rests, strict=True)):
            wanted = math.copysign(speed, progress.rest) + SYNC_PER_S * (rest - progress.rest)
            left_deg = abs(wheel.ratio) * (abs(rest) - progress.speed * delay_s) + BEHIND_DEG
            if not lease.drive(wheel.ratio * wanted, left_deg=left_deg):
                progress.begin(number, self._link.now())
        return left <= creeping

    def _settle(self) -> Steps[float]:
        """Wait until the wheels stand still; returns how far they are from the goal."""
        link, before = self._link, None
        deadline = link.now() + SETTLE_S
        while True:
            began = link.now()
            _, rests = self._look()
            if rests == before or began >= deadline:
                weights = [abs(wheel.ratio) for wheel in self._wheels]
                return sum(weight * each for weight, each in zip(weights, rests, strict=True)) / sum(weights)
            before = rests
            yield began + 2 * CYCLE_S
