"""What could be done next, with its time and chance: ways round, places to look from, other targets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Protocol

import numpy as np

from behaviors.adaptive.angles import wrapped_deg
from behaviors.adaptive.follow_path import ELBOW_MM
from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.world_model import TargetEstimate
from behaviors.evidence import AlternativeTarget, Detour, Viewpoint
from behaviors.mission import AdaptiveParameters
from behaviors.ports import Point

SPACING_MM = 400.0
"""Between places that are considered as viewpoints."""
NEAREST_MM = 350.0
"""Looking from places nearer than this is looking from here."""
CANDIDATES, OFFERED = 60, 3
"""So many of the quickest to reach are weighed, and so many of the most promising are offered."""
TURN_S, SCAN_S, RESCAN_S = 1.5, 7.0, 8.0
"""What it takes to turn to where one goes, to look round there, and to look again here; measured in the simulator."""

MOVING_OFF_S = 10.0
"""What it takes to move off as the thesis does, by a turn and ten advances."""
LEAST_EXTRA_S = 0.5
"""No way round is quicker than the straight one, whatever the map says."""
BESIDE_MM = 160.0
"""Between places that are considered as ends of a way round."""
ELBOWS_MM = (ELBOW_MM, 0.0, -60.0)
"""Room beside the last, straight stretch: as much as there is; the map makes things larger than they are."""
NEAREST_END_MM, FARTHEST_END_MM = 330.0, 1000.0
"""Between these distances from the target a way round ends; nearer than the first, the target itself echoes."""
SLANT_DEG = 57.0
"""A picture is seen up to so far from its normal. Source: docs/vision.md section 1.3, the fitted law."""
NEWS_S = 60.0
"""Where another target was seen it still is, in one case out of e, after so long."""


class WorldView(Protocol):
    """The world model as candidates are generated from it: queries only."""

    @property
    def here(self) -> Point:
        """Where the robot is."""
        ...

    @property
    def known(self) -> Mapping[str, TargetEstimate]:
        """The targets that were seen, by name."""
        ...

    @property
    def paths(self) -> PathPlanner:
        """All paths from here."""
        ...

    def clear_between(self, start: Point, end: Point, short_mm: float = 0.0, elbow_mm: float = 0.0) -> bool:
        """Whether the robot could drive straight from `start` to `short_mm` before `end`."""
        ...

    def chance_from(self, target: str, place: Point) -> float:
        """Probability that one look round from a place finds the target."""
        ...

    def novelty(self, target: str, place: Point) -> float:
        """How much of a look from there is not a repetition of an earlier one, 0..1."""
        ...

    def tried(self, target: str, destination: Point) -> bool:
        """Whether the robot set off for that destination from here before."""
        ...


class CandidateGenerator:
    """What the map and the beliefs promise, from where the robot is; changes neither.

    Args:
        world: What is known.
        profile: The numbers.
    """

    def __init__(self, world: WorldView, profile: AdaptiveParameters) -> None:
        self._world = world
        self._profile = profile

    def detour(self, target: str) -> Detour | None:
        """The quickest way to a place from which the straight way to a target that was seen is free."""
        known = self._world.known.get(target)
        way = known and self._way_round(known)
        if not known or not way:
            return None
        place, seconds = way
        extra_s = max(LEAST_EXTRA_S, seconds - self._straight_s(known)) + 2 * TURN_S
        return Detour(extra_s, self._world.paths.route_to(place))

    def here(self, target: str) -> Viewpoint:
        """Another look round from here."""
        return Viewpoint(0.0, RESCAN_S, self._world.chance_from(target, self._world.here))

    def viewpoints(self, target: str) -> tuple[Viewpoint, ...]:
        """The places from which looking is most worth its time."""
        if not self._profile.chooses_viewpoints:
            return (Viewpoint(MOVING_OFF_S, SCAN_S, 1.0),)
        world, routes = self._world, self._world.paths
        places = routes.places(SPACING_MM, known=True)
        travel_s = routes.seconds_to(places) + TURN_S
        far = np.hypot(places[:, 0] - world.here[0], places[:, 1] - world.here[1]) >= NEAREST_MM
        places, travel_s = places[far], travel_s[far]
        order = [i for i in np.argsort(travel_s)[:CANDIDATES] if not world.tried(target, (places[i, 0], places[i, 1]))]
        found = []
        for i in order:
            place = float(places[i, 0]), float(places[i, 1])
            chance = world.chance_from(target, place) * world.novelty(target, place)
            found.append((chance, float(travel_s[i]), place))
        found.sort(key=lambda each: -each[0] / (each[1] + SCAN_S))
        return tuple(
            Viewpoint(seconds, SCAN_S, chance, routes.route_to(place)) for chance, seconds, place in found[:OFFERED]
        )

    def others(self, targets: Iterable[str], now_s: float) -> tuple[AlternativeTarget, ...]:
        """Those of other targets that were seen and to which a way leads."""
        found = []
        for target in targets:
            known = self._world.known.get(target)
            travel_s = math.inf if known is None else self._seconds_to(known)
            if known is not None and math.isfinite(travel_s):
                age_s = now_s - known.time_s
                found.append(AlternativeTarget(target, travel_s, age_s, math.exp(-age_s / NEWS_S)))
        return tuple(found)

    def _seconds_to(self, known: TargetEstimate) -> float:
        """Time to a target that was seen; infinity where the map knows no way."""
        if self._world.clear_between(self._world.here, known.place, NEAREST_END_MM):
            return TURN_S + self._straight_s(known)
        way = self._way_round(known)
        return 2 * TURN_S + way[1] if way else math.inf

    def _straight_s(self, known: TargetEstimate) -> float:
        return math.dist(self._world.here, known.place) / self._profile.cruise_mm_s

    def _way_round(self, known: TargetEstimate) -> tuple[Point, float] | None:
        """Where a way ends from which the straight way to the target is free, and the time to the target that way."""
        world, routes = self._world, self._world.paths
        places = routes.places(BESIDE_MM, known=False)
        dx, dy = places[:, 0] - known.place[0], places[:, 1] - known.place[1]
        away_mm = np.hypot(dx, dy)
        slant_deg = np.abs(wrapped_deg(np.degrees(np.arctan2(dy, dx)) - known.seen_deg))
        useful = (away_mm >= NEAREST_END_MM) & (away_mm <= FARTHEST_END_MM) & (slant_deg <= SLANT_DEG)
        places, away_mm, slant_deg = places[useful], away_mm[useful], slant_deg[useful]
        seconds = routes.seconds_to(places) + away_mm / self._profile.cruise_mm_s
        # it may face any way from which it could be seen so far
        visible = 1.0 - slant_deg / (2 * SLANT_DEG)
        order = [i for i in np.argsort((seconds + TURN_S) / visible) if math.isfinite(seconds[i])]
        for elbow_mm in ELBOWS_MM:
            for i in order:
                place = float(places[i, 0]), float(places[i, 1])
                if world.clear_between(place, known.place, NEAREST_END_MM, elbow_mm):
                    return place, float(seconds[i])
        return None
