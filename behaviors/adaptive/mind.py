"""The adaptive profile at work: gathers what is known of a failure, has the policy choose, and carries it out."""

from __future__ import annotations

import math

import numpy as np

from behaviors.adaptive.approach import SHUT_MM, Approach
from behaviors.adaptive.memory import Known, Memory
from behaviors.adaptive.pause import Rescan, Wait
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.adaptive.routes import Routes
from behaviors.adaptive.scan import Scan
from behaviors.adaptive.travel import ELBOW_MM, Travel
from behaviors.adaptive.watch import Watch
from behaviors.agenda import Agenda, Fate
from behaviors.events import Fact, Reason
from behaviors.mission import Mission
from behaviors.recovery import Blocker, Choice, Detour, Evidence, Other, Point, RecoveryPolicy, Viewpoint
from behaviors.skills import Moving, Senses, Service

IN_THE_WAY = (Reason.BLOCKED_SHORT, Reason.BLOCKED_LONG, Reason.LOST_BEHIND, Reason.NO_PROGRESS)
"""Failures for which something between the robot and the target is to blame."""
UNKNOWN_RANGE_MM = 150.0
"""What stops the wheels unseen is about so far before the sonar."""
SAME_BLOCKER_S = 40.0
"""What was in the way so short a time ago is still the same."""

EYES_ONLY_S = 20.0
"""When the map knows no way at all it is more likely wrong than the robot is shut in; so long it is not minded."""
SPACING_MM = 400.0
"""Between places that are considered as viewpoints."""
NEAREST_MM = 350.0
"""Looking from places nearer than this is looking from here."""
CANDIDATES, OFFERED = 60, 3
TURN_S, SCAN_S, RESCAN_S = 1.5, 7.0, 8.0
"""What it takes to turn to where one goes, to look round there, and to look again here; measured in the simulator."""

BESIDE_MM = 160.0
ELBOWS_MM = (ELBOW_MM, 0.0, -60.0)
"""Room beside the last, straight stretch: as much as there is; the map makes things larger than they are."""
AROUND_MM = (330.0, 1000.0)
"""Between these distances from the target a way round it ends."""
SLANT_DEG = 57.0
"""A picture is seen up to so far from its normal. Source: docs/vision.md, slant."""


class AdaptiveMind:
    """The adaptive profile.

    Args:
        senses: What to work with.
        mission: Its table ``adaptive`` has the numbers.
        agenda: Whose present target is pursued; targets that are given up are tried again.
        policy: Another rule for the recoveries.
    """

    def __init__(self, senses: Senses, mission: Mission, agenda: Agenda, policy: RecoveryPolicy | None = None) -> None:
        profile = mission.adaptive
        agenda.rounds = max(agenda.rounds, profile.rounds)
        self._senses = senses
        self._profile = profile
        self._agenda = agenda
        self._memory = Memory(mission)
        self._watch = Watch(senses, profile, self._memory, agenda)
        self._policy = policy or AdaptivePolicy.of(profile)
        self._pursuit: tuple[str, int] | None = None
        self._pursued_s = 0.0
        self._eyes_only_s = -math.inf
        self._blocked: tuple[Point, float, float] | None = None

    def service(self, state: str, choice: Choice | None) -> Service:
        """One of the adaptive services."""
        if state == "search":
            self._begin_pursuit()
            return Scan(self._watch)
        if state == "arrive":
            trusts_map = self._watch.now() - self._eyes_only_s > EYES_ONLY_S
            return Approach(self._watch, minds_map=trusts_map)
        if choice is None:
            raise KeyError(state)
        if state == "wait":
            return Wait(self._watch, choice.wait_s)
        if state == "rescan":
            return Rescan(self._watch)
        if state == "move_to" and not choice.route:
            return Moving(self._senses, choice.turn_deg)
        if state in ("move_to", "detour"):
            return Travel(self._watch, choice.route)
        raise KeyError(state)

    def evidence(self, failure: Evidence, fact: Fact) -> Evidence:
        """What is known of a failure: what is in the way, and what could be done, with its time and chance."""
        memory, target = self._memory, failure.target
        memory.settle()
        blocker = self._blocker(fact)
        if fact.reason is Reason.TARGET_LOST:
            memory.beliefs[target].scatter()
        routes = Routes(memory.floor, memory.here, self._profile.cruise_mm_s)
        if not routes.lead_out(SPACING_MM):
            # nobody is walled in: the map is wrong
            memory.floor.forget_obstacles()
            routes = Routes(memory.floor, memory.here, self._profile.cruise_mm_s)
        known = memory.known.get(target)
        detour = self._detour(routes, known) if blocker and known and self._profile.detours else None
        if blocker and detour is None:
            self._eyes_only_s = self._watch.now()
        return Evidence(
            target=target,
            reason=failure.reason,
            exist=failure.exist,
            researches=failure.researches,
            round=self._agenda.round,
            targets_left=sum(errand.fate is not Fate.REACHED for errand in self._agenda.errands),
            spent_s=self._spent_s(target),
            blocker=blocker,
            detour=detour,
            here=self._here(target),
            viewpoints=self._viewpoints(routes, target),
            others=self._others(),
            repeats=memory.repeats(target),
        )

    def select(self, evidence: Evidence) -> Choice:
        """Choose by the policy, and remember where."""
        choice = self._policy.select(evidence)
        self._memory.chose(evidence.target, choice.kind, choice.route[-1] if choice.route else None)
        return choice

    def _begin_pursuit(self) -> None:
        pursuit = self._agenda.target, self._agenda.errand.tries
        if pursuit != self._pursuit:
            self._pursuit, self._pursued_s = pursuit, self._watch.now()

    def _spent_s(self, target: str) -> float:
        known = self._memory.known.get(target)
        since_s = self._pursued_s if known is None else max(self._pursued_s, known.time_s)
        return self._watch.now() - since_s

    def _blocker(self, fact: Fact) -> Blocker | None:
        """What is in the way; it goes onto the floor map."""
        if fact.reason not in IN_THE_WAY:
            return None
        memory, now_s = self._memory, self._watch.now()
        measured = fact.evidence.get("range_mm")
        range_mm = float(measured) if isinstance(measured, int | float) else UNKNOWN_RANGE_MM
        if range_mm <= SHUT_MM and not fact.evidence.get("remembered"):
            memory.floor.block(memory.pose, range_mm)
        place = memory.pose.ahead(range_mm)
        since_s = now_s
        if self._blocked is not None:
            before, begun_s, last_s = self._blocked
            if math.dist(before, place) < 400.0 and now_s - last_s < SAME_BLOCKER_S:
                since_s = begun_s
        self._blocked = (place, since_s, now_s)
        hides = bool(fact.evidence.get("hides", fact.reason is not Reason.NO_PROGRESS))
        return Blocker(range_mm, now_s - since_s, bool(fact.evidence.get("sudden", False)), hides)

    def _detour(self, routes: Routes, known: Known) -> Detour | None:
        """The quickest way to a place from which the straight way to the target is free."""
        memory = self._memory
        places = routes.places(BESIDE_MM, known=False)
        dx, dy = places[:, 0] - known.place[0], places[:, 1] - known.place[1]
        away_mm = np.hypot(dx, dy)
        slant_deg = np.abs((np.degrees(np.arctan2(dy, dx)) - known.seen_deg + 180.0) % 360.0 - 180.0)
        useful = (away_mm >= AROUND_MM[0]) & (away_mm <= AROUND_MM[1]) & (slant_deg <= SLANT_DEG)
        places, away_mm, slant_deg = places[useful], away_mm[useful], slant_deg[useful]
        if not len(places):
            return None
        seconds = routes.seconds_to(places) + away_mm / self._profile.cruise_mm_s
        # it may face any way from which it could be seen so far
        visible = 1.0 - slant_deg / (2 * SLANT_DEG)
        order = [i for i in np.argsort((seconds + TURN_S) / visible) if math.isfinite(seconds[i])]
        for elbow_mm in ELBOWS_MM:
            for i in order:
                place = (float(places[i, 0]), float(places[i, 1]))
                if memory.floor.clear_between(place, known.place, AROUND_MM[0], elbow_mm):
                    straight_s = math.dist(memory.here, known.place) / self._profile.cruise_mm_s
                    extra_s = max(0.5, float(seconds[i]) - straight_s) + 2 * TURN_S
                    return Detour(extra_s, routes.route_to(place))
        return None

    def _here(self, target: str) -> Viewpoint:
        memory = self._memory
        return Viewpoint(0.0, RESCAN_S, memory.beliefs[target].chance_from(*memory.here, memory.floor))

    def _viewpoints(self, routes: Routes, target: str) -> tuple[Viewpoint, ...]:
        """The places from which looking is most worth its time."""
        if not self._profile.chooses_viewpoints:
            return (Viewpoint(10.0, SCAN_S, 1.0),)
        memory = self._memory
        places = routes.places(SPACING_MM, known=True)
        travel_s = routes.seconds_to(places) + TURN_S
        far = np.hypot(places[:, 0] - memory.pose.x_mm, places[:, 1] - memory.pose.y_mm) >= NEAREST_MM
        places, travel_s = places[far], travel_s[far]
        order = [i for i in np.argsort(travel_s)[:CANDIDATES] if not memory.tried(target, (places[i, 0], places[i, 1]))]
        belief = memory.beliefs[target]
        found = []
        for i in order:
            place = float(places[i, 0]), float(places[i, 1])
            chance = belief.chance_from(*place, memory.floor) * memory.novelty(target, place)
            found.append((chance, float(travel_s[i]), place))
        found.sort(key=lambda each: -each[0] / (each[1] + SCAN_S))
        return tuple(
            Viewpoint(seconds, SCAN_S, chance, routes.route_to(place)) for chance, seconds, place in found[:OFFERED]
        )

    def _others(self) -> tuple[Other, ...]:
        """Other targets that were seen."""
        now_s = self._watch.now()
        waiting = [errand.target for errand in self._agenda.errands if errand.fate is not Fate.REACHED]
        seen = {name: known for name, known in self._memory.known.items() if name in waiting}
        seen.pop(self._agenda.target, None)
        return tuple(
            Other(name, math.dist(self._memory.here, known.place) / self._profile.cruise_mm_s, now_s - known.time_s)
            for name, known in seen.items()
        )
