"""Turning one wheel, or two together, by a given angle, from the PC: smoothly, exactly, and over slow links.

The firmware's own tacho limit coasts past its target (docs/firmware.md section 1, fact 12), so the PC decides when to
brake. It accounts for the link: a reading is older than its arrival, and a command acts later than it was sent. The
last stretch is done at a creeping speed, and the moment of braking is computed rather than polled for.
"""

from __future__ import annotations

import contextlib
import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from behaviors.ports import Stop
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from nxtdrive.outputs import FULL_SPEED_DEG_S, Sample, braked, driven, sample

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

CREEP_DEG_S = 60.0
"""Speed of the last stretch: six counts per regulation period."""
CREEP_DEG = 15.0
"""Length of the last stretch."""
REGULATION_LAG_S = 0.12
"""How late the regulated motor follows a change of speed: one period of 101 ms and the motor's own lag."""
START_S = 0.16
"""From rest a regulated motor does nothing for one period of 101 ms (docs/firmware.md section 1, fact 15), and its own
inertia holds it back for TAU, 60 ms (section 0.2)."""
SEEN_DEG_S = 20.0
"""From this speed on a wheel is seen to move."""
BRAKING_S = 0.015
"""A braked motor turns on by its speed times this. Source: docs/firmware.md section 0.2, TAUBRAKE."""
CYCLE_S = 0.02
"""Shortest time between two looks at the wheels; the regulator itself acts only five times less often."""
WINDOW_S = 0.08
"""Over this time the speed is measured; one count in one cycle says nothing yet."""
LEASE_S = 0.6
"""A motion that nobody renews goes on for about this time."""
LEASE_DEG = 20.0
"""Shortest lease: a slow motor's few degrees must not run out between two renewals."""
STALL_S = 0.7
"""A wheel that has not moved for this time, though it should, is stalled."""
STALL_DEG = 2.0
TOLERANCE_DEG = 2.0
"""A wheel that stopped this close to its goal stays there."""
CORRECTIONS = 3
"""How often a missed goal is approached again."""
SYNC_PER_S = 2.5
"""Speed, in deg/s, taken from a wheel for each degree it is ahead of the other."""
SETTLE_S = 0.4
"""Longest wait for a braked wheel to stand still."""


@dataclass(frozen=True, slots=True)
class Wheel:
    """A motor that takes part.

    Attributes:
        port: Where it is plugged in.
        sign: +1 if it turns forward to come nearer to the goal, else -1.
    """

    port: OutputPort
    sign: int


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


Guard = Callable[[bool], Stop | None]


def unguarded(_near: bool) -> Stop | None:
    """A guard that lets everything pass."""
    return None


class Travel:
    """One motion of some wheels, all by the same angle, each in its own direction.

    Args:
        brick: Where the motors are.
        wheels: Which ones take part.
        pace: How fast.
        guard: Asked again and again; what it objects ends the motion. It is told whether the goal is near: the last
            stretch leaves no time for questions to sensors.
        note: Shown every reading.
    """

    def __init__(
        self,
        brick: Brick,
        wheels: Sequence[Wheel],
        pace: Pace,
        *,
        guard: Guard = unguarded,
        note: Callable[[Sample], None] = lambda _: None,
    ) -> None:
        self._brick = brick
        self._wheels = wheels
        self._ports = [wheel.port for wheel in wheels]
        self._pace = pace
        self._guard = guard
        self._note = note
        self._goals: list[float] = []
        self._throttle = Throttle(brick)
        self._cycle_s = CYCLE_S

    def run(self, angle_deg: float) -> Stop:
        """Turn the wheels by `angle_deg` and brake them.

        Returns:
            Why it ended: what `guard` said, or DONE, STALLED, TIMEOUT.

        Raises:
            LinkError: The brick cannot be reached; it was told to brake if possible, else the lease runs out.
        """
        try:
            return self._run(angle_deg)
        except BaseException:
            with contextlib.suppress(LinkError):
                self.brake()
            raise

    def brake(self) -> None:
        """Stop all wheels now."""
        self._throttle.brake(self._ports)

    def _run(self, angle_deg: float) -> Stop:
        start = sample(self._brick, *self._ports)
        self._goals = [at + wheel.sign * angle_deg for at, wheel in zip(start.angles_deg, self._wheels, strict=True)]
        rest = angle_deg
        for _ in range(1 + CORRECTIONS):
            stop = self._approach(rest)
            self.brake()
            rest = self._settle()
            if stop is not None:
                return stop
            if abs(rest) <= TOLERANCE_DEG:
                break
        return Stop.DONE

    def _approach(self, angle_deg: float) -> Stop | None:
        """Drive until it is time to brake; returns what else ended it."""
        brick, progress = self._brick, Progress()
        deadline = brick.now() + self._pace.duration_s(abs(angle_deg))
        near = False
        while True:
            stop = self._guard(near)
            began = brick.now()
            reading, rests = self._look()
            progress.note(reading.time_s, rests)
            stop = stop or progress.stalled() or (Stop.TIMEOUT if began > deadline else None)
            if stop is not None:
                return stop
            brake_in_s = progress.brake_at(reading.delay_s) - brick.now()
            if brake_in_s <= self._cycle_s:
                brick.sleep(brake_in_s)
                return None
            near = self._drive(progress, rests, reading.delay_s)
            brick.sleep(CYCLE_S - (brick.now() - began))
            self._cycle_s = brick.now() - began

    def _look(self) -> tuple[Sample, list[float]]:
        """The wheels, and how far each still has to go in its own direction."""
        reading = sample(self._brick, *self._ports)
        self._note(reading)
        rests = [
            wheel.sign * (goal - at)
            for wheel, goal, at in zip(self._wheels, self._goals, reading.angles_deg, strict=True)
        ]
        return reading, rests

    def _drive(self, progress: Progress, rests: list[float], delay_s: float) -> bool:
        """Set each wheel's speed by the profile, and keep the wheels together; returns whether the goal is near."""
        creeping = CREEP_DEG + CREEP_DEG_S * (delay_s + self._cycle_s)
        ahead = progress.speed * (delay_s + REGULATION_LAG_S)
        left = abs(progress.rest) - ahead - creeping
        speed = self._pace.at(progress.done, left)
        for wheel, rest in zip(self._wheels, rests, strict=True):
            wanted = math.copysign(speed, progress.rest) + SYNC_PER_S * (rest - progress.rest)
            self._throttle.run(wheel.port, wheel.sign * wanted)
        return left <= creeping

    def _settle(self) -> float:
        """Wait until the wheels stand still; returns how far they are from the goal."""
        brick, before = self._brick, None
        deadline = brick.now() + SETTLE_S
        while True:
            _, rests = self._look()
            if rests == before or brick.now() >= deadline:
                return sum(rests) / len(rests)
            before = rests
            brick.sleep(2 * CYCLE_S)


class Throttle:
    """Speeds for motors, each with its lease; what has not changed is not sent again before half the lease is over.

    Whoever holds the throttle has the motor: what `Motor.run` and `Motor.dc` have begun is not renewed any more.
    """

    def __init__(self, brick: Brick) -> None:
        self._brick = brick
        self._given: dict[OutputPort, tuple[int, float]] = {}

    def run(self, port: OutputPort, speed_deg_s: float) -> None:
        """Let a motor turn at a regulated speed for one more lease."""
        power = max(-100, min(100, round(speed_deg_s / FULL_SPEED_DEG_S * 100)))
        now = self._brick.now()
        given, until = self._given.get(port, (None, 0.0))
        if power == given and now < until:
            return
        self._brick.moves(port)
        self._brick.forget(port.name)
        lease_deg = round(max(LEASE_DEG, abs(power) / 100 * FULL_SPEED_DEG_S * LEASE_S))
        self._brick.send(driven(port, power, lease_deg, regulated=True))
        self._given[port] = (power, now + LEASE_S / 2)

    def brake(self, ports: Iterable[OutputPort]) -> None:
        """Stop motors now."""
        self._given.clear()
        for port in ports:
            self._brick.forget(port.name)
            self._brick.send(braked(port))


class Progress:
    """How a motion comes along.

    Attributes:
        rest: Degrees to the goal, negative if it lies behind.
        done: Degrees covered since the first note.
        speed: Towards the goal, deg/s, over the last `WINDOW_S`; 0 until there is something to compare.
    """

    def __init__(self) -> None:
        self.rest = self.done = self.speed = 0.0
        self._notes: deque[tuple[float, float]] = deque()
        self._moved: list[tuple[float, float]] = []
        self._first = self._began = self._now = 0.0
        self._direction = 1.0

    def note(self, time_s: float, rests: Sequence[float]) -> None:
        """Take one reading: when it was, and how far each wheel had to go."""
        rest = sum(rests) / len(rests)
        if not self._moved:
            self._first, self._began, self._direction = rest, time_s, math.copysign(1, rest)
            self._moved = [(time_s, each) for each in rests]
        self._now, self.rest, self.done = time_s, rest, abs(self._first - rest)
        notes = self._notes
        notes.append((time_s, rest))
        while len(notes) > 2 and time_s - notes[1][0] >= WINDOW_S:
            notes.popleft()
        then, before = notes[0]
        if time_s > then:
            self.speed = (before - rest) / (time_s - then) * self._direction
        for i, each in enumerate(rests):
            if abs(each - self._moved[i][1]) > STALL_DEG:
                self._moved[i] = (time_s, each)

    def brake_at(self, delay_s: float) -> float:
        """When to send the brake, on the link's clock.

        A wheel seen moving is at the goal after `rest` / `speed`. A short motion may be over before its speed could be
        seen; it is reckoned from its first command, in step with which the regulator counts.

        Args:
            delay_s: Round trip of the link; half of it passes before the brake acts.
        """
        rest = self.rest * self._direction
        if rest <= 0:
            return 0.0
        if self.speed >= SEEN_DEG_S:
            return self._now + rest / self.speed - BRAKING_S - delay_s / 2
        return self._began + delay_s / 2 + START_S + self._first * self._direction / CREEP_DEG_S - BRAKING_S

    def stalled(self) -> Stop | None:
        """STALLED if some wheel has not moved for `STALL_S`."""
        return Stop.STALLED if any(self._now - since > STALL_S for since, _ in self._moved) else None
