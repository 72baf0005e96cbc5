"""What was tried for each target: what was chosen and where, and where an attempt failed for which reason."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from behaviors.events import Reason
from behaviors.ports import Point

SAME_PLACE_MM = 250.0
"""Attempts and choices no farther apart than this are made at one place."""
SAME_AIM_MM = 450.0
"""A target farther than this from its earlier estimate is approached as a new one."""
BESIDE_MM = 260.0
"""An approach that passes a place where one failed, at less than this distance, would fail there too."""
REMEMBERED_S = 90.0
"""After this time an approach that failed may be tried again: things move."""


@dataclass(frozen=True, slots=True)
class _FailedApproach:
    target: str
    place: Point
    aim: Point
    time_s: float


@dataclass(frozen=True, slots=True)
class _FailedAttempt:
    target: str
    round: int
    reason: Reason
    place: Point


class Attempts:
    """The attempts of one mission."""

    def __init__(self) -> None:
        self._choices: list[tuple[str, str, Point]] = []
        self._tries: Counter[str] = Counter()
        self._destinations: list[tuple[str, Point, Point]] = []
        self._failures: list[_FailedAttempt] = []
        self._approaches: list[_FailedApproach] = []

    def chose(self, target: str, recovery: str, here: Point, destination: Point | None = None) -> None:
        """Remember that a recovery was chosen here, and where it leads."""
        self._choices.append((target, recovery, here))
        self._tries[target] += 1
        if destination is not None:
            self._destinations.append((target, here, destination))

    def approached(self, target: str) -> None:
        """Remember that an approach to a target has begun."""
        self._tries[target] = 0

    def tries(self, target: str) -> int:
        """Return the number of choices for a target since it was last approached."""
        return self._tries[target]

    def tried(self, target: str, here: Point, destination: Point) -> bool:
        """Return whether the robot set off for that destination from here before."""
        return any(
            which == target and _same_place(start, here) and _same_place(end, destination)
            for which, start, end in self._destinations
        )

    def repeats(self, target: str, here: Point) -> dict[str, int]:
        """Return how often each recovery was chosen at this place for this target."""
        near = (recovery for which, recovery, place in self._choices if which == target and _same_place(place, here))
        return dict(Counter(near))

    def failed(self, target: str, round_number: int, reason: Reason, here: Point) -> None:
        """Remember that an attempt at a target in this round failed here."""
        self._failures.append(_FailedAttempt(target, round_number, reason, here))

    def failures(self) -> tuple[int, int]:
        """Return how often attempts of this round failed as the last one did, at its place, and how often in a row.

        Those in a row are at one place if they are near the first of them, as when a robot goes to and fro.
        """
        if not self._failures:
            return 0, 0
        first, run = self._failures[0], 0
        for each in self._failures:
            first, run = (first, run + 1) if _alike(first, each) else (each, 1)
        return sum(_alike(each, self._failures[-1]) for each in self._failures), run

    def approach_failed(self, target: str, here: Point, aim: Point, now_s: float) -> None:
        """Remember that the approach to a target estimated to be at `aim` came no farther than here."""
        self._approaches.append(_FailedApproach(target, here, aim, now_s))

    def new_approach(self, target: str, start: Point, aim: Point, now_s: float) -> bool:
        """Return whether the straight path to a target leads clear of the places where approaches failed lately."""
        return all(
            _distance_mm(each.place, start, aim) >= BESIDE_MM
            for each in self._approaches
            if each.target == target and now_s - each.time_s <= REMEMBERED_S and math.dist(each.aim, aim) <= SAME_AIM_MM
        )


def _alike(one: _FailedAttempt, other: _FailedAttempt) -> bool:
    """Return whether two failures are of one kind and at one place; where wheels slipped, odometry does not count."""
    same = (one.target, one.round, one.reason) == (other.target, other.round, other.reason)
    return same and (one.reason is Reason.SLIPPED or _same_place(one.place, other.place))


def _same_place(one: Point, other: Point) -> bool:
    return math.dist(one, other) <= SAME_PLACE_MM


def _distance_mm(point: Point, start: Point, end: Point) -> float:
    """Return the distance of a point from the line segment between two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length2 = dx * dx + dy * dy
    share = 0.0 if length2 == 0 else ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / length2
    share = min(1.0, max(0.0, share))
    return math.dist(point, (start[0] + share * dx, start[1] + share * dy))
