"""What could be done next, with its time and chance: detours, places to look from, other targets."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from behaviors.adaptive.follow_path import CLEARANCE_MM
from behaviors.adaptive.target_memory import TargetEstimate
from behaviors.adaptive.world_model import WorldModel
from behaviors.evidence import AlternativeTarget, Detour, Viewpoint
from behaviors.mission import AdaptiveParameters
from behaviors.ports import Point

SPACING_MM = 400.0
"""Distance between the places considered as viewpoints."""
NEAREST_MM = 350.0
"""Looking from nearer than this is looking from here."""
CONSIDERED_PLACES = 120
"""Number of viewpoints considered: those that can be reached soonest."""
OFFERED_PLACES = 3
"""Number of viewpoints offered: the most promising of them."""
FRONTIER_HIT_CHANCE = 0.2
"""Chance that a target on the unknown floor beyond a viewpoint is found soon after going there."""
TURN_S = 1.5
"""Time to turn towards a destination. This and the next three were measured in the simulator."""
SCAN_S = 7.0
"""Time to scan there."""
RESCAN_S = 8.0
"""Time to look again here."""
MOVING_OFF_S = 10.0
"""Time to move off as the thesis does, by a turn and ten advances."""
LEAST_EXTRA_S = 0.5
"""A detour takes at least this much longer than the straight path, since the map errs."""
END_SPACING_MM = 160.0
"""Distance between the places considered as ends of a detour."""
CLEARANCES_MM = (CLEARANCE_MM, 0.0, -60.0)
"""Room beside the last, straight stretch, tried in this order: the map makes objects larger than they are, hence the
last one."""
NEAREST_END_MM = 330.0
"""A detour ends no nearer to the target than this, since the target itself gives an echo."""
FARTHEST_END_MM = 1000.0
"""A detour ends no farther away from the target than this."""
MIN_VISIBLE_CHANCE = 0.1
"""The end of a detour shows the target with at least this probability."""
NEWS_S = 60.0
"""Another target is still where it was seen, with probability 1/e, after this time."""


class ViewpointGain(NamedTuple):
    """The gain of a scan from a place.

    Attributes:
        place: Where.
        travel_s: Time to get there.
        chance: That the target is found there, or soon after.
    """

    place: Point
    travel_s: float
    chance: float


class CandidateGenerator:
    """Generates candidates from the world model without changing it.

    Args:
        world: What is known.
        parameters: The mission's numbers.
    """

    def __init__(self, world: WorldModel, parameters: AdaptiveParameters) -> None:
        self._world = world
        self._parameters = parameters

    def detour(self, target: str) -> Detour | None:
        """Return the quickest path to a place from which the straight path to a target that was seen is free."""
        known = self._world.targets.known.get(target)
        end = known and self._detour_end(target, known)
        if not known or not end:
            return None
        place, seconds = end
        extra_s = max(LEAST_EXTRA_S, seconds - self._straight_s(known)) + 2 * TURN_S
        route = self._world.paths.route_to(place)
        return Detour(extra_s, route, self._world.paths.unknown_mm((*route, known.place)))

    def here(self, target: str) -> Viewpoint:
        """Return another scan from here."""
        world = self._world
        return Viewpoint(0.0, RESCAN_S, world.targets.beliefs[target].chance_from(*world.here, world.floor))

    def viewpoints(self, target: str) -> tuple[Viewpoint, ...]:
        """Return the places where a scan gains most per time."""
        if not self._parameters.chooses_viewpoints:
            return (Viewpoint(MOVING_OFF_S, SCAN_S, 1.0),)
        # prefer places from which an approach does not pass one that failed lately
        gains = self.gains(target)
        found = [each for each in gains if self._world.new_approach(target, each.place)] or gains
        found.sort(key=lambda each: -each.chance / (each.travel_s + SCAN_S))
        route_to = self._world.paths.route_to
        return tuple(Viewpoint(one.travel_s, SCAN_S, one.chance, route_to(one.place)) for one in found[:OFFERED_PLACES])

    def gains(self, target: str) -> list[ViewpointGain]:
        """Return the gain of a scan from each place considered."""
        world, paths = self._world, self._world.paths
        places = paths.reachable_places(SPACING_MM, known=True)
        travel_s = paths.seconds_to(places) + TURN_S
        far = np.hypot(places[:, 0] - world.here[0], places[:, 1] - world.here[1]) >= NEAREST_MM
        places, travel_s = places[far], travel_s[far]
        nearest = np.argsort(travel_s)[:CONSIDERED_PLACES]
        untried = [
            ((x_mm, y_mm), seconds)
            for (x_mm, y_mm), seconds in zip(places[nearest].tolist(), travel_s[nearest].tolist(), strict=True)
            if not world.attempts.tried(target, world.here, (x_mm, y_mm))
        ]
        chances = world.targets.chances_from(target, [place for place, _ in untried])
        gains = []
        for (place, seconds), (found, beyond) in zip(untried, chances, strict=True):
            chance = min(1.0, found + FRONTIER_HIT_CHANCE * beyond)  # a scan also shows some of what is beyond
            gains.append(ViewpointGain(place, seconds, chance * world.targets.novelty(target, place)))
        return gains

    def others(self, targets: Iterable[str], now_s: float) -> tuple[AlternativeTarget, ...]:
        """Return those of these targets that were seen and to which a path leads."""
        found = []
        for target in targets:
            known = self._world.targets.known.get(target)
            travel_s = math.inf if known is None else self._seconds_to(target, known)
            if known is not None and math.isfinite(travel_s):
                age_s = now_s - known.time_s
                found.append(AlternativeTarget(target, travel_s, age_s, math.exp(-age_s / NEWS_S)))
        return tuple(found)

    def _seconds_to(self, target: str, known: TargetEstimate) -> float:
        """Return the time to a target that was seen; infinity where the map shows no path."""
        if self._world.floor.clear_between(self._world.here, known.place, NEAREST_END_MM):
            return TURN_S + self._straight_s(known)
        end = self._detour_end(target, known)
        return 2 * TURN_S + end[1] if end else math.inf

    def _straight_s(self, known: TargetEstimate) -> float:
        return math.dist(self._world.here, known.place) / self._parameters.cruise_mm_s

    def _detour_end(self, target: str, known: TargetEstimate) -> tuple[Point, float] | None:
        """Return where a detour ends, with a free straight path to the target, and the time to the target along it."""
        world, paths = self._world, self._world.paths
        places = paths.reachable_places(END_SPACING_MM, known=False)
        dx, dy = places[:, 0] - known.place[0], places[:, 1] - known.place[1]
        away_mm = np.hypot(dx, dy)
        visible = world.targets.beliefs[target].faces(known.place, places)
        useful = (away_mm >= NEAREST_END_MM) & (away_mm <= FARTHEST_END_MM) & (visible >= MIN_VISIBLE_CHANCE)
        places, away_mm, visible = places[useful], away_mm[useful], visible[useful]
        seconds = paths.seconds_to(places) + away_mm / self._parameters.cruise_mm_s
        order = [i for i in np.argsort((seconds + TURN_S) / visible) if math.isfinite(seconds[i])]
        for clearance_mm in CLEARANCES_MM:
            for i in order:
                place = float(places[i, 0]), float(places[i, 1])
                free = world.floor.clear_between(place, known.place, NEAREST_END_MM, clearance_mm)
                if free and world.new_approach(target, place):
                    return place, float(seconds[i])
        return None
