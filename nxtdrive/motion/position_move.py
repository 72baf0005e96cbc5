"""Turn one wheel, or two together, by an exact angle under control of the PC, even over slow links.

At the firmware's own tacho limit a motor coasts past its target (docs/firmware.md section 1, fact 12), so the PC
decides when to brake. It accounts for latency: a reading is older than its arrival, and a command acts later than it
was sent. The last stretch is driven at creep speed, and the time of braking is predicted, not polled for. The limit of
the lease lies just behind the goal, so that after a pause of the computer the motor only coasts past it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from behaviors.ports import StopReason
from firmware_protocol.enums import OutputPort
from nxtdrive.link.link import Link
from nxtdrive.link.scheduler import Cancelled, Steps
from nxtdrive.motion.brake_predictor import CREEP_DEG_S, BrakePredictor, weighted_mean
from nxtdrive.motion.lease import Lease, brake_all, stopping_on_error
from nxtdrive.motion.outputs import Sample, sample
from nxtdrive.motion.stall import STALL_S, StallDetector

CREEP_DEG = 15.0
"""Length of the last stretch."""
REGULATION_LAG_S = 0.12
"""Delay with which a regulated motor follows a change of speed: one period of 101 ms and the motor's own lag."""
CYCLE_S = 0.02
"""Shortest time between two readings of the wheels, a fifth of the regulator's period."""
TOLERANCE_DEG = 2.0
"""A wheel that stops this close to its goal is not corrected."""
CORRECTIONS = 5
"""Largest number of further approaches to a missed goal."""
BEHIND_DEG = 3.0
"""Distance of the lease's limit behind the goal, so that the brake, not the limit, ends the motion."""
MISSED_DEG = 15.0
"""A motion that ends farther from its goal is not DONE."""
SYNC_PER_S = 2.5
"""Speed, in deg/s, subtracted from a wheel for each degree it is ahead of the other."""
SETTLE_S = 0.4
"""Longest wait for a braked wheel to stand still."""
LATE, LATE_S = 2.0, 2.0
"""A motion ends with TIMEOUT after this many times the duration of its speed profile plus this many seconds, for
latency, creeping, settling and corrections."""


@dataclass(frozen=True, slots=True)
class Wheel:
    """A motor of a motion.

    Attributes:
        port: Its port.
        ratio: Degrees it turns per degree of the motion, -1..1 except 0; negative: backward.
    """

    port: OutputPort
    ratio: float


@dataclass(frozen=True, slots=True)
class SpeedProfile:
    """Speed profile of the wheels.

    Attributes:
        speed_deg_s: Cruising speed.
        acceleration_deg_s2: Of speeding up and slowing down.
    """

    speed_deg_s: float
    acceleration_deg_s2: float

    @property
    def creep_deg_s(self) -> float:
        """Speed of the last stretch."""
        return min(CREEP_DEG_S, self.speed_deg_s)

    def at(self, done_deg: float, left_deg: float) -> float:
        """Return the speed after `done_deg`, with `left_deg` left until the creep begins."""
        return min(self.speed_deg_s, self._after(done_deg), self._after(left_deg))

    def _after(self, angle_deg: float) -> float:
        """Return the speed that creeping wheels reach by `angle_deg`."""
        if angle_deg <= 0:  # the product below is not a number for an unlimited acceleration
            return self.creep_deg_s
        return math.sqrt(self.creep_deg_s**2 + 2 * self.acceleration_deg_s2 * angle_deg)

    def timeout_s(self, angle_deg: float) -> float:
        """Return the longest time a motion of `angle_deg` should take."""
        return LATE_S + LATE * (angle_deg / self.speed_deg_s + 2 * self.speed_deg_s / self.acceleration_deg_s2)


Guard = Callable[[bool], StopReason | None]


def unguarded(_near: bool) -> StopReason | None:
    """Never end a motion: no guard."""
    return None


class PositionMove:
    """A motion of wheels that start and stop together, each turning by its own ratio.

    Args:
        link: The link to the brick.
        wheels: The motors.
        profile: How fast.
        guard: Called in each cycle; a reason that it returns ends the motion. Its argument is whether the goal is near:
            the last stretch leaves no time to read sensors.
        on_reading: Called with each reading of the wheels.
        lease_s: About how long the wheels keep turning without a renewal.
        stall_s: A wheel that stands for this time although it should turn ends the motion.
    """

    def __init__(
        self,
        link: Link,
        wheels: Sequence[Wheel],
        profile: SpeedProfile,
        *,
        guard: Guard = unguarded,
        on_reading: Callable[[Sample], None] = lambda _: None,
        lease_s: float,
        stall_s: float = STALL_S,
    ) -> None:
        self._link = link
        self._wheels = wheels
        self._ports = [wheel.port for wheel in wheels]
        self._weights = [abs(wheel.ratio) for wheel in wheels]
        self._profile = profile
        self._guard = guard
        self._on_reading = on_reading
        self._goals: list[float] = []
        self._stalls: list[StallDetector] = []
        self._leases = [Lease(link, wheel.port, lease_s) for wheel in wheels]
        self._stall_s = stall_s
        self._cycle_s = CYCLE_S

    def steps(self, angle_deg: float, start: Sample | None = None) -> Steps[StopReason]:
        """Turn the wheels by `angle_deg` and brake them, step by step.

        Args:
            angle_deg: Of the motion; each wheel turns by its ratio of it.
            start: The reading of the wheels from which the angle is measured; a new one by default.

        Returns:
            The reason of `guard`, or DONE, STALLED, CANCELLED, or TIMEOUT after too much time or too many corrections.

        Raises:
            LinkError: The brick cannot be reached; the motors were braked if possible, else the lease runs out.
        """
        try:
            with stopping_on_error(self._brake):
                return (yield from self._run(angle_deg, start))
        except Cancelled:
            return StopReason.CANCELLED

    def _brake(self) -> None:
        brake_all(self._leases)

    def _run(self, angle_deg: float, start: Sample | None) -> Steps[StopReason]:
        start = start or sample(self._link, *self._ports)
        self._goals = [at + wheel.ratio * angle_deg for at, wheel in zip(start.angles_deg, self._wheels, strict=True)]
        remaining_deg = angle_deg
        for _ in range(1 + CORRECTIONS):
            stop = yield from self._approach(remaining_deg)
            self._brake()
            remaining_deg = yield from self._settle()
            if stop is not None:
                return stop
            if abs(remaining_deg) <= TOLERANCE_DEG:
                break
        return StopReason.DONE if abs(remaining_deg) <= MISSED_DEG else StopReason.TIMEOUT

    def _approach(self, angle_deg: float) -> Steps[StopReason | None]:
        """Drive until it is time to brake; returns None, or the reason to end earlier."""
        link = self._link
        progress = BrakePredictor(self._weights, self._profile.creep_deg_s)
        self._stalls = [StallDetector(self._stall_s) for _ in self._wheels]
        deadline = link.now() + self._profile.timeout_s(abs(angle_deg))
        near = driven = False
        while True:
            stop = self._guard(near)
            began = link.now()
            reading, remaining_deg = self._read_wheels()
            progress.update(reading.time_s, remaining_deg)
            for stall, each_deg in zip(self._stalls, remaining_deg, strict=True):
                stall.update(reading.time_s, each_deg)
            stalled = any(stall.stalled for stall in self._stalls)
            stop = stop or (StopReason.STALLED if stalled else StopReason.TIMEOUT if began > deadline else None)
            if stop is not None:
                return stop
            brake_at = progress.brake_at(reading.delay_s)
            if (progress.remaining_deg and not driven) or brake_at - link.now() > self._cycle_s:
                near, driven = self._drive(progress, remaining_deg, reading.delay_s), True
            if brake_at - link.now() <= self._cycle_s:
                if brake_at > link.now():
                    for lease in self._leases:
                        lease.brake_at(brake_at)
                    yield brake_at
                return None
            yield began + CYCLE_S
            self._cycle_s = link.now() - began

    def _read_wheels(self) -> tuple[Sample, list[float]]:
        """Read the wheels; returns the reading and each wheel's degrees to the goal, in its own direction."""
        reading = sample(self._link, *self._ports)
        self._on_reading(reading)
        remaining_deg = [
            (goal - at) / wheel.ratio
            for wheel, goal, at in zip(self._wheels, self._goals, reading.angles_deg, strict=True)
        ]
        return reading, remaining_deg

    def _drive(self, progress: BrakePredictor, remaining_deg: list[float], delay_s: float) -> bool:
        """Set each wheel's speed by the profile and synchronise the wheels; returns whether the goal is near."""
        creeping = CREEP_DEG + CREEP_DEG_S * (delay_s + self._cycle_s)
        ahead = progress.speed_deg_s * (delay_s + REGULATION_LAG_S)
        left = abs(progress.remaining_deg) - ahead - creeping
        speed = self._profile.at(progress.covered_deg, left)
        for wheel, lease, stall, each_deg in zip(self._wheels, self._leases, self._stalls, remaining_deg, strict=True):
            wanted = math.copysign(speed, progress.remaining_deg) + SYNC_PER_S * (each_deg - progress.remaining_deg)
            left_deg = abs(wheel.ratio) * (abs(each_deg) - progress.speed_deg_s * delay_s) + BEHIND_DEG
            if not lease.drive(wheel.ratio * wanted, left_deg=left_deg):
                stall.restart(self._link.now())  # the command was only just sent, maybe long after the reading
        return left <= creeping

    def _settle(self) -> Steps[float]:
        """Wait until the wheels stand; returns their distance to the goal."""
        link, before = self._link, None
        deadline = link.now() + SETTLE_S
        while True:
            began = link.now()
            _, remaining_deg = self._read_wheels()
            if remaining_deg == before or began >= deadline:
                return weighted_mean(remaining_deg, self._weights)
            before = remaining_deg
            yield began + 2 * CYCLE_S
