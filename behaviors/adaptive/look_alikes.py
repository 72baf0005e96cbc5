"""Look-alikes: objects taken for a target, and doubtful ones set aside until a better one has been looked for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from behaviors.ports import Point, Sighting

NEAR_MM = 450.0
"""Sightings no farther than this from a look-alike are of it."""
NEAR_SHARE = 0.3
"""While it is not settled what is there, sightings no farther apart than this share of their distance, if that is more
than `NEAR_MM`, are of one object."""
REJECTED_S = 60.0
"""It is tested again after this time."""
NEEDED_LOOKS = 2
"""A doubtful object is taken for the target after scans from this many places without a better one; after one if
nothing else was ever taken for it."""
APART_MM = 500.0
"""These places are at least this far apart: what hides a target from one hides it from beside it."""


@dataclass(frozen=True, slots=True)
class _LookAlike:
    target: str
    place: Point
    time_s: float
    doubtful: bool
    looked_from: list[Point] = field(default_factory=list)

    def is_at(self, target: str, place: Point) -> bool:
        return self.target == target and math.dist(self.place, place) <= NEAR_MM


class LookAlikes:
    """Rejected look-alikes, and whether targets are found steadily in this mission's light."""

    def __init__(self) -> None:
        self._known: list[_LookAlike] = []
        self._steady: bool | None = None
        self._seen: dict[str, list[Point]] = {}
        self._latest: dict[str, Sighting] = {}
        self._confused: list[Point] = []

    def reject(self, target: str, place: Point, time_s: float, *, doubtful: bool) -> None:
        """Reject the object there for some time; `doubtful` if it may be the target in poor light."""
        self._known.append(_LookAlike(target, place, time_s, doubtful))

    def rejected(self, target: str, place: Point, time_s: float) -> bool:
        """Return whether a detection there is known not to be the target."""
        return any(
            each.is_at(target, place) and time_s - each.time_s <= REJECTED_S and not self._released(each)
            for each in self._known
        )

    def looked_round(self, target: str, here: Point) -> Point | None:
        """Remember a scan that did not show the target; return a doubtful place if it may be taken for it now."""
        released = None
        for each in self._known:
            if each.target != target or not each.doubtful or self._released(each):
                continue
            if all(math.dist(here, before) >= APART_MM for before in each.looked_from):
                each.looked_from.append(here)
                released = each.place if self._released(each) else released
        return released

    def seen(self, sighting: Sighting, place: Point) -> None:
        """Remember where something was taken for a target, and whether it was taken for another in the same frame."""
        places = self._seen.setdefault(sighting.target, [])
        if all(math.dist(place, before) > max(NEAR_MM, NEAR_SHARE * sighting.distance_mm) for before in places):
            places.append(place)
        self._latest[sighting.target] = sighting
        if any(_show_one_thing(sighting, other) for other in self._latest.values()) and not self._confused_at(place):
            self._confused.append(place)

    def _confused_at(self, place: Point) -> bool:
        return any(math.dist(place, before) <= NEAR_MM for before in self._confused)

    def _alone(self, target: str) -> bool:
        """Return whether everything taken for the target was in one place."""
        return len(self._seen.get(target, ())) < 2

    def arrived(self, *, steady: bool) -> None:
        """Remember that a target was reached, and whether it was found as steadily as in good light."""
        self._steady = bool(self._steady) or steady

    def accepts(self, target: str, place: Point) -> bool:
        """Return whether the object there may be the target although it is not found steadily.

        If one target was found steadily, the others are too. In poor light none is: then it is the target if nothing
        else was taken for it. Otherwise the object is set aside, and is the target if no better one was found since
        from several places. An object taken for two targets in one frame has to be found steadily to be either.
        """
        if self._steady or self._confused_at(place):
            return False
        if self._steady is not None and self._alone(target):
            return True
        return any(self._released(each) and each.is_at(target, place) for each in self._known)

    def _released(self, each: _LookAlike) -> bool:
        """Return whether a better one was looked for often enough; several objects taken for the target need more."""
        return each.doubtful and len(each.looked_from) >= (1 if self._alone(each.target) else NEEDED_LOOKS)


def _show_one_thing(a: Sighting, b: Sighting) -> bool:
    """Return whether one frame showed two targets in one place: the middle of one within the box of the other."""
    if a.target == b.target or a.time_s != b.time_s:
        return False
    left, top, width, height = a.box
    return abs(b.box[0] + b.box[2] / 2 - left - width / 2) < width / 2 and (
        abs(b.box[1] + b.box[3] / 2 - top - height / 2) < height / 2
    )
