"""What could be done next, with its time and chance: detours, places to look from, other targets."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from behaviors.adaptive.follow_path import TUNING as PATH
from behaviors.adaptive.target_memory import TargetEstimate
from behaviors.adaptive.world_model import WorldModel
from behaviors.evidence import AlternativeTarget, Detour, Viewpoint
from behaviors.mission import AdaptiveParameters
from behaviors.ports import Point


@dataclass(frozen=True, slots=True)
class CandidateTuning:
    """Tuning constants of the candidates; times were measured in the simulator.

    Attributes:
        spacing_mm: Distance between the places considered as viewpoints.
        nearest_mm: Looking from nearer than this is looking from here.
        considered: Number of viewpoints considered: those that can be reached soonest.
        offered: Number of viewpoints offered: the most promising of them.
        frontier_hit: Chance that a target on the unknown floor beyond a viewpoint is found soon after going there.
        turn_s: Time to turn towards a destination.
        scan_s: Time to scan there.
        rescan_s: Time to look again here.
        moving_off_s: Time to move off as the thesis does, by a turn and ten advances.
        least_extra_s: A detour takes at least this much longer than the straight path, since the map errs.
        end_spacing_mm: Distance between the places considered as ends of a detour.
        clearances_mm: Room beside the last, straight stretch, tried in this order: the map makes objects larger than
            they are, hence the last one.
        nearest_end_mm: A detour ends no nearer to the target than this, since the target itself gives an echo.
        farthest_end_mm: A detour ends no farther away from the target than this.
        least_visible: The end of a detour shows the target with at least this probability.
        news_s: Another target is still where it was seen, with probability 1/e, after this time.
    """

    spacing_mm: float = 400.0
    nearest_mm: float = 350.0
    considered: int = 120
    offered: int = 3
    frontier_hit: float = 0.2
    turn_s: float = 1.5
    scan_s: float = 7.0
    rescan_s: float = 8.0
    moving_off_s: float = 10.0
    least_extra_s: float = 0.5
    end_spacing_mm: float = 160.0
    clearances_mm: tuple[float, ...] = (PATH.clearance_mm, 0.0, -60.0)
    nearest_end_mm: float = 330.0
    farthest_end_mm: float = 1000.0
    least_visible: float = 0.1
    news_s: float = 60.0


TUNING = CandidateTuning()


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
        extra_s = max(TUNING.least_extra_s, seconds - self._straight_s(known)) + 2 * TUNING.turn_s
        route = self._world.paths.route_to(place)
        return Detour(extra_s, route, self._world.paths.unknown_mm((*route, known.place)))

    def here(self, target: str) -> Viewpoint:
        """Return another scan from here."""
        return Viewpoint(0.0, TUNING.rescan_s, self._world.targets.chance_from(target, self._world.here))

    def viewpoints(self, target: str) -> tuple[Viewpoint, ...]:
        """Return the places where a scan gains most per time."""
        if not self._parameters.chooses_viewpoints:
            return (Viewpoint(TUNING.moving_off_s, TUNING.scan_s, 1.0),)
        # prefer places from which an approach does not pass one that failed lately
        gains = self.gains(target)
        found = [each for each in gains if self._world.new_approach(target, each.place)] or gains
        found.sort(key=lambda each: -each.chance / (each.travel_s + TUNING.scan_s))
        route_to = self._world.paths.route_to
        return tuple(
            Viewpoint(one.travel_s, TUNING.scan_s, one.chance, route_to(one.place)) for one in found[: TUNING.offered]
        )

    def gains(self, target: str) -> list[ViewpointGain]:
        """Return the gain of a scan from each place considered."""
        world, paths = self._world, self._world.paths
        places = paths.reachable_places(TUNING.spacing_mm, known=True)
        travel_s = paths.seconds_to(places) + TUNING.turn_s
        far = np.hypot(places[:, 0] - world.here[0], places[:, 1] - world.here[1]) >= TUNING.nearest_mm
        places, travel_s = places[far], travel_s[far]
        nearest = np.argsort(travel_s)[: TUNING.considered]
        untried = [
            ((x_mm, y_mm), seconds)
            for (x_mm, y_mm), seconds in zip(places[nearest].tolist(), travel_s[nearest].tolist(), strict=True)
            if not world.attempts.tried(target, world.here, (x_mm, y_mm))
        ]
        chances = world.targets.chances_from(target, [place for place, _ in untried])
        gains = []
        for (place, seconds), (found, beyond) in zip(untried, chances, strict=True):
            chance = min(1.0, found + TUNING.frontier_hit * beyond)  # a scan also shows some of what is beyond
            gains.append(ViewpointGain(place, seconds, chance * world.targets.novelty(target, place)))
        return gains

    def others(self, targets: Iterable[str], now_s: float) -> tuple[AlternativeTarget, ...]:
        """Return those of other targets that were seen and to which a path leads."""
        found = []
        for target in targets:
            known = self._world.targets.known.get(target)
            travel_s = math.inf if known is None else self._seconds_to(target, known)
            if known is not None and math.isfinite(travel_s):
                age_s = now_s - known.time_s
                found.append(AlternativeTarget(target, travel_s, age_s, math.exp(-age_s / TUNING.news_s)))
        return tuple(found)

    def _seconds_to(self, target: str, known: TargetEstimate) -> float:
        """Return the time to a target that was seen; infinity where the map shows no path."""
        if self._world.floor.clear_between(self._world.here, known.place, TUNING.nearest_end_mm):
            return TUNING.turn_s + self._straight_s(known)
        end = self._detour_end(target, known)
        return 2 * TUNING.turn_s + end[1] if end else math.inf

    def _straight_s(self, known: TargetEstimate) -> float:
        return math.dist(self._world.here, known.place) / self._parameters.cruise_mm_s

    def _detour_end(self, target: str, known: TargetEstimate) -> tuple[Point, float] | None:
        """Return where a detour ends, with a free straight path to the target, and the time to the target along it."""
        world, paths = self._world, self._world.paths
        places = paths.reachable_places(TUNING.end_spacing_mm, known=False)
        dx, dy = places[:, 0] - known.place[0], places[:, 1] - known.place[1]
        away_mm = np.hypot(dx, dy)
        visible = world.targets.faces(target, known.place, places)
        useful = (
            (away_mm >= TUNING.nearest_end_mm) & (away_mm <= TUNING.farthest_end_mm) & (visible >= TUNING.least_visible)
        )
        places, away_mm, visible = places[useful], away_mm[useful], visible[useful]
        seconds = paths.seconds_to(places) + away_mm / self._parameters.cruise_mm_s
        order = [i for i in np.argsort((seconds + TUNING.turn_s) / visible) if math.isfinite(seconds[i])]
        for clearance_mm in TUNING.clearances_mm:
            for i in order:
                place = float(places[i, 0]), float(places[i, 1])
                free = world.floor.clear_between(place, known.place, TUNING.nearest_end_mm, clearance_mm)
                if free and world.new_approach(target, place):
                    return place, float(seconds[i])
        return None
