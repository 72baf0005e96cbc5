"""The adaptive profile at work: gathers what is known of a failure, has the policy choose, and carries it out."""

from __future__ import annotations

import math

from behaviors.adaptive.approach import SHUT_MM, ApproachSkill
from behaviors.adaptive.candidate_generator import CandidateGenerator
from behaviors.adaptive.follow_path import FollowPathSkill
from behaviors.adaptive.perception import Perception
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.adaptive.scan import ScanSkill
from behaviors.adaptive.wait_rescan import RescanSkill, WaitSkill
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Fact, Reason
from behaviors.mission import Mission
from behaviors.recovery import Blocker, Choice, Evidence, Point, RecoveryPolicy
from behaviors.skills import Service, SkillContext, ThesisMoveSkill
from behaviors.target_queue import TargetQueue

IN_THE_WAY = (Reason.BLOCKED_SHORT, Reason.BLOCKED_LONG, Reason.LOST_BEHIND, Reason.NO_PROGRESS)
"""Failures for which something between the robot and the target is to blame."""
UNHEARD_MM = 150.0
"""What stops the wheels unseen is about so far before the sonar."""
SAME_BLOCKER_S, SAME_BLOCKER_MM = 40.0, 400.0
"""What was in the way so short a time ago, and so near to there, is still the same."""
EYES_ONLY_S = 20.0
"""When the map knows no way at all it is more likely wrong than the robot is shut in; so long it is not minded."""


class AdaptiveProfile:
    """The adaptive profile.

    Args:
        context: What to work with.
        mission: Its table ``adaptive`` has the numbers.
        queue: Whose present target is pursued; targets that are given up are tried again.
        policy: Another rule for the recoveries.
    """

    def __init__(
        self, context: SkillContext, mission: Mission, queue: TargetQueue, policy: RecoveryPolicy | None = None
    ) -> None:
        profile = mission.adaptive
        queue.rounds = max(queue.rounds, profile.rounds)
        self._context = context
        self._profile = profile
        self._queue = queue
        self._world = WorldModel(mission)
        self._perception = Perception(context, profile, self._world, queue)
        self._policy = policy or AdaptivePolicy.of(profile)
        self._pursuit: tuple[str, int] | None = None
        self._pursued_s = 0.0
        self._eyes_only_s = -math.inf
        self._blocked: tuple[Point, float, float] | None = None

    def service(self, state: str, choice: Choice | None) -> Service:
        """One of the adaptive services."""
        if state == "search":
            self._begin_pursuit()
            return ScanSkill(self._perception)
        if state == "arrive":
            trusts_map = self._perception.now() - self._eyes_only_s > EYES_ONLY_S
            return ApproachSkill(self._perception, minds_map=trusts_map)
        if choice is None:
            raise KeyError(state)
        if state == "wait":
            return WaitSkill(self._perception, choice.wait_s)
        if state == "rescan":
            return RescanSkill(self._perception)
        if state == "move_to" and not choice.route:
            return ThesisMoveSkill(self._context, choice.turn_deg)
        if state in ("move_to", "detour"):
            return FollowPathSkill(self._perception, choice.route)
        raise KeyError(state)

    def evidence(self, failure: Evidence, fact: Fact) -> Evidence:
        """What is known of a failure: what is in the way, and what could be done, with its time and chance."""
        world, target = self._world, failure.target
        world.settle()
        blocker = self._blocker(fact)
        if fact.reason is Reason.TARGET_LOST and not fact.evidence.get("oblique"):
            world.beliefs[target].scatter()
        candidates = CandidateGenerator(world, self._profile)
        detour = candidates.detour(target) if blocker and self._profile.detours else None
        if blocker and detour is None:
            self._eyes_only_s = self._perception.now()
        return Evidence(
            target=target,
            reason=failure.reason,
            exist=failure.exist,
            researches=failure.researches,
            round=self._queue.round,
            targets_left=1 + len(self._queue.later),
            spent_s=self._spent_s(target),
            blocker=blocker,
            detour=detour,
            here=candidates.here(target),
            viewpoints=candidates.viewpoints(target),
            others=() if self._profile.in_order else candidates.others(self._queue.earlier, self._perception.now()),
            repeats=world.repeats(target),
        )

    def select(self, evidence: Evidence) -> Choice:
        """Choose by the policy, and remember where."""
        choice = self._policy.select(evidence)
        self._world.chose(evidence.target, choice.kind, choice.route[-1] if choice.route else None)
        return choice

    def _begin_pursuit(self) -> None:
        pursuit = self._queue.target, self._queue.round
        if pursuit != self._pursuit:
            self._pursuit, self._pursued_s = pursuit, self._perception.now()

    def _spent_s(self, target: str) -> float:
        known = self._world.known.get(target)
        since_s = self._pursued_s if known is None else max(self._pursued_s, known.time_s)
        return self._perception.now() - since_s

    def _blocker(self, fact: Fact) -> Blocker | None:
        """What is in the way; it goes onto the floor map."""
        if fact.reason not in IN_THE_WAY:
            return None
        world, now_s = self._world, self._perception.now()
        measured = fact.evidence.get("range_mm")
        range_mm = float(measured) if isinstance(measured, int | float) else UNHEARD_MM
        if fact.reason is Reason.NO_PROGRESS or fact.evidence.get("touched"):
            # the echo may be of something behind what holds it
            range_mm = min(range_mm, UNHEARD_MM)
        if range_mm <= SHUT_MM and not fact.evidence.get("remembered"):
            world.floor.block(world.pose, range_mm)
        place = world.pose.ahead(range_mm)
        since_s = now_s
        if self._blocked is not None:
            before, begun_s, last_s = self._blocked
            if math.dist(before, place) < SAME_BLOCKER_MM and now_s - last_s < SAME_BLOCKER_S:
                since_s = begun_s
        self._blocked = (place, since_s, now_s)
        hides = bool(fact.evidence.get("hides", fact.reason is not Reason.NO_PROGRESS))
        return Blocker(range_mm, now_s - since_s, bool(fact.evidence.get("sudden", False)), hides)
