"""The adaptive profile at work: gathers what is known of a failure, has the policy choose, and carries it out."""

from __future__ import annotations

import math

from behaviors.adaptive.approach import SHUT_MM, Approach
from behaviors.adaptive.memory import Memory
from behaviors.adaptive.pause import Rescan, Wait
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.adaptive.prospects import Prospects
from behaviors.adaptive.scan import Scan
from behaviors.adaptive.travel import Travel
from behaviors.adaptive.watch import Watch
from behaviors.agenda import Agenda
from behaviors.events import Fact, Reason
from behaviors.mission import Mission
from behaviors.recovery import Blocker, Choice, Evidence, Point, RecoveryPolicy
from behaviors.skills import Moving, Senses, Service

IN_THE_WAY = (Reason.BLOCKED_SHORT, Reason.BLOCKED_LONG, Reason.LOST_BEHIND, Reason.NO_PROGRESS)
"""Failures for which something between the robot and the target is to blame."""
UNHEARD_MM = 150.0
"""What stops the wheels unseen is about so far before the sonar."""
SAME_BLOCKER_S, SAME_BLOCKER_MM = 40.0, 400.0
"""What was in the way so short a time ago, and so near to there, is still the same."""
EYES_ONLY_S = 20.0
"""When the map knows no way at all it is more likely wrong than the robot is shut in; so long it is not minded."""


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
        if fact.reason is Reason.TARGET_LOST and not fact.evidence.get("oblique"):
            memory.beliefs[target].scatter()
        prospects = Prospects(memory, self._profile)
        detour = prospects.detour(target) if blocker and self._profile.detours else None
        if blocker and detour is None:
            self._eyes_only_s = self._watch.now()
        return Evidence(
            target=target,
            reason=failure.reason,
            exist=failure.exist,
            researches=failure.researches,
            round=self._agenda.round,
            targets_left=1 + len(self._agenda.later),
            spent_s=self._spent_s(target),
            blocker=blocker,
            detour=detour,
            here=prospects.here(target),
            viewpoints=prospects.viewpoints(target),
            others=() if self._profile.in_order else prospects.others(self._agenda.earlier, self._watch.now()),
            repeats=memory.repeats(target),
        )

    def select(self, evidence: Evidence) -> Choice:
        """Choose by the policy, and remember where."""
        choice = self._policy.select(evidence)
        self._memory.chose(evidence.target, choice.kind, choice.route[-1] if choice.route else None)
        return choice

    def _begin_pursuit(self) -> None:
        pursuit = self._agenda.target, self._agenda.round
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
        range_mm = float(measured) if isinstance(measured, int | float) else UNHEARD_MM
        if fact.reason is Reason.NO_PROGRESS or fact.evidence.get("touched"):
            # the echo may be of something behind what holds it
            range_mm = min(range_mm, UNHEARD_MM)
        if range_mm <= SHUT_MM and not fact.evidence.get("remembered"):
            memory.floor.block(memory.pose, range_mm)
        place = memory.pose.ahead(range_mm)
        since_s = now_s
        if self._blocked is not None:
            before, begun_s, last_s = self._blocked
            if math.dist(before, place) < SAME_BLOCKER_MM and now_s - last_s < SAME_BLOCKER_S:
                since_s = begun_s
        self._blocked = (place, since_s, now_s)
        hides = bool(fact.evidence.get("hides", fact.reason is not Reason.NO_PROGRESS))
        return Blocker(range_mm, now_s - since_s, bool(fact.evidence.get("sudden", False)), hides)
