"""The adaptive profile: learns from a failure, gathers evidence, has the policy choose, and executes the choice."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from behaviors.adaptive.approach import ApproachSkill
from behaviors.adaptive.attempts import SAME_PLACE_MM
from behaviors.adaptive.candidate_generator import CandidateGenerator
from behaviors.adaptive.follow_path import FollowPathSkill
from behaviors.adaptive.perception import Perception
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.adaptive.scan import ScanSkill
from behaviors.adaptive.wait_rescan import RescanSkill, WaitSkill
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Event, Fact, Reason
from behaviors.evidence import Evidence, Viewpoint
from behaviors.failures import Failure
from behaviors.mission import Mission
from behaviors.ports import Point
from behaviors.recoveries import (
    CHANGE_TARGET,
    DETOUR,
    MOVE_TO,
    RESCAN,
    WAIT,
    Choice,
    RecoveryPolicy,
    checked_choice,
    per_success_s,
)
from behaviors.return_types import checked
from behaviors.skills import Skill, SkillContext
from behaviors.target_queue import TargetQueue
from behaviors.thesis.skills import ThesisMoveSkill

MIN_INTERVAL_S = 1.0
"""Minimum time between two decisions of a robot that has not moved; meanwhile it observes at rest."""
MAP_IGNORED_S = 20.0
"""A map without any path is probably wrong, not the robot walled in, so it is ignored for this time."""


def _move(perception: Perception, choice: Choice) -> Skill:
    if choice.route:
        return FollowPathSkill(perception, choice.route)
    return ThesisMoveSkill(perception.context, choice.turn_deg)


SKILLS: dict[str, Callable[[Perception, Choice], Skill]] = {
    WAIT.name: lambda perception, choice: WaitSkill(perception, choice.wait_s),
    MOVE_TO.name: _move,
    DETOUR.name: _move,
    RESCAN.name: lambda perception, _: RescanSkill(perception),
}
"""The skill of each recovery, by name."""


class _NewEvidenceFirst:
    """Holds back a failure until there is new evidence for another decision.

    Args:
        skill: Fails or not.
        await_new_evidence: Observes at rest for as long as necessary.
    """

    def __init__(self, skill: Skill, await_new_evidence: Callable[[], None]) -> None:
        self._skill = skill
        self._await_new_evidence = await_new_evidence
        self._failure: Failure | None = None

    def call(self) -> Fact:
        """Return what the skill reports; called again after an outage, it keeps waiting with the same failure."""
        fact = self._failure or checked(self._skill.call, Fact)
        if isinstance(fact, Failure):
            self._failure = fact
            self._await_new_evidence()
        return fact


class AdaptiveProfile:
    """The adaptive profile.

    Args:
        context: What to work with.
        mission: Its table ``adaptive`` has the numbers.
        queue: Its current target is pursued; targets that are given up are tried again.
        policy: Another policy than the profile's own.

    Attributes:
        world: Its world model; displays may read it between two records of the journal.
    """

    def __init__(
        self, context: SkillContext, mission: Mission, queue: TargetQueue, policy: RecoveryPolicy | None = None
    ) -> None:
        parameters = mission.adaptive
        queue.rounds = max(queue.rounds, parameters.rounds)
        if not parameters.in_order:
            queue.first_of = self._soonest
        queue.due = lambda target: target in self._left_unseen and target in self.world.targets.known
        self._parameters = parameters
        self._queue = queue
        self.world = WorldModel(mission)
        self._perception = Perception(context, parameters, self.world, queue)
        self._policy = policy or checked(self.own_policy, RecoveryPolicy, mission)  # type: ignore[type-abstract]
        self._pursuit: tuple[str, int] | None = None
        self._pursued_s = 0.0
        self._map_ignored_s: float | None = None
        self._decided: tuple[float, Point] | None = None
        self._destined: Viewpoint | None = None
        self._left_unseen: set[str] = set()

    @classmethod
    def own_policy(cls, mission: Mission) -> RecoveryPolicy:
        """Return the policy that weighs candidates."""
        return AdaptivePolicy(mission.adaptive)

    def skill(self, state: str, choice: Choice | None) -> Skill:
        """Return the skill for a state, wrapped so that its failure leads to no hasty decision."""
        return _NewEvidenceFirst(self._skill(state, choice), self._await_new_evidence)

    def _await_new_evidence(self) -> None:
        """Observe at rest until a decision here has newer evidence than the last one.

        A doubtful sonar is tested first, since its echoes may have made the skill fail.
        """
        if self._perception.sonar.doubtful:
            self._perception.check_sonar()
        self.world.pose = self._perception.context.body.pose()  # it has come to rest since the last look
        while self._decided is not None:
            decided_s, place = self._decided
            elapsed_s = self._perception.now() - decided_s
            if elapsed_s >= MIN_INTERVAL_S or math.dist(place, self.world.here) > SAME_PLACE_MM:
                return
            self._perception.step()

    def _skill(self, state: str, choice: Choice | None) -> Skill:
        if state == "search":
            self._begin_pursuit()
            return ScanSkill(self._perception)
        if state == "arrive":
            self._destined = None
            self.world.attempts.approached(self._queue.target)
        if state in ("arrive", "verify"):
            return ApproachSkill(self._perception, trusts_map=self._trusts_map(), stands=state == "verify")
        if choice is None:
            raise KeyError(state)
        return SKILLS[state](self._perception, choice)

    def learn(self, failure: Failure) -> None:
        """Update the world model."""
        forgotten = self.world.floor.forgotten
        self.world.learn(self._queue.target, failure, self._perception.now(), self._queue.round)
        if self.world.floor.forgotten > forgotten:
            self._report(Event.MAP_CLEARED, Reason.WALLED_IN)

    def _soonest(self, targets: Sequence[str]) -> str:
        """Return the target that can be reached soonest, or the first that has not just been left."""
        others = [target for target in targets if target != self._queue.target] or list(targets)
        known = CandidateGenerator(self.world, self._parameters).others(others, self._perception.now())
        soonest = min(known, key=lambda each: per_success_s(each.travel_s, each.chance), default=None)
        return soonest.target if soonest else others[0]

    def evidence(self, basis: Evidence) -> Evidence:
        """Add the blocker, and the candidates with their times and chances."""
        world, target = self.world, basis.target
        candidates = CandidateGenerator(world, self._parameters)
        failures, run = world.attempts.failures()
        return replace(
            basis,
            round=self._queue.round,
            targets_left=1 + len(self._queue.later),
            spent_s=self._spent_s(target),
            blocker=world.blocker,
            blocked=self._destined if world.blocker and world.blocker.hides else None,
            detour=candidates.detour(target) if world.blocker and self._parameters.detours else None,
            here=candidates.here(target),
            viewpoints=candidates.viewpoints(target),
            others=() if self._parameters.in_order else candidates.others(self._queue.earlier, self._perception.now()),
            repeats=world.attempts.repeats(target, world.here),
            tries=world.attempts.tries(target),
            failures=failures,
            run=run,
        )

    def select(self, evidence: Evidence) -> Choice:
        """Choose by the policy, and remember where; without a path past the blocker, distrust the map."""
        if evidence.blocker and evidence.detour is None:
            self._map_ignored_s = self._perception.now()
            self._report(Event.MAP_DISTRUSTED, Reason.NO_WAY)
        choice = checked_choice(self._policy.select, evidence, self._queue.names)
        destination = choice.route[-1] if choice.route else None
        if choice.kind is CHANGE_TARGET and evidence.target not in self.world.targets.known:
            self._left_unseen.add(evidence.target)
        if choice.kind is not WAIT:
            self._destined = next((each for each in evidence.viewpoints if each.route == choice.route), None)
        self.world.attempts.chose(evidence.target, choice.kind.name, self.world.here, destination)
        self._decided = self._perception.now(), self.world.here
        return choice

    def _trusts_map(self) -> bool:
        """Return whether an approach that begins now takes account of the map; its distrust ends after a time."""
        if self._map_ignored_s is not None and self._perception.now() - self._map_ignored_s > MAP_IGNORED_S:
            self._map_ignored_s = None
            self._report(Event.MAP_TRUSTED, Reason.DISTRUST_OVER)
        return self._map_ignored_s is None

    def _report(self, event: Event, reason: Reason) -> None:
        self._perception.context.report(Fact(event, reason))

    def _begin_pursuit(self) -> None:
        pursuit = self._queue.target, self._queue.round
        self._left_unseen.discard(self._queue.target)
        if pursuit != self._pursuit:
            self._pursuit, self._pursued_s = pursuit, self._perception.now()

    def _spent_s(self, target: str) -> float:
        known = self.world.targets.known.get(target)
        since_s = self._pursued_s if known is None else max(self._pursued_s, known.time_s)
        return self._perception.context.active_s(since_s)
