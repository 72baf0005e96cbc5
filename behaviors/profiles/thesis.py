"""The profile of the thesis."""

from __future__ import annotations

from behaviors.evidence import Evidence
from behaviors.failures import Failure
from behaviors.mission import Mission
from behaviors.recoveries import MOVE_TO, WAIT, Choice, RecoveryPolicy, checked_choice
from behaviors.return_types import checked
from behaviors.skills import Skill, SkillContext
from behaviors.target_queue import TargetQueue
from behaviors.thesis.policy import ThesisPolicy
from behaviors.thesis.skills import ThesisArriveSkill, ThesisMoveSkill, ThesisSearchSkill, ThesisWaitSkill


class ThesisProfile:
    """The profile of the thesis.

    Args:
        context: What to work with.
        mission: Its table ``thesis`` has the numbers.
        queue: Its current target is pursued.
        policy: Another policy than the thesis's.
    """

    def __init__(
        self, context: SkillContext, mission: Mission, queue: TargetQueue, policy: RecoveryPolicy | None = None
    ) -> None:
        self._context = context
        self._queue = queue
        self._policy = policy or checked(self.own_policy, RecoveryPolicy, mission)  # type: ignore[type-abstract]

    @classmethod
    def own_policy(cls, mission: Mission) -> RecoveryPolicy:
        """Return the thesis's policy."""
        return ThesisPolicy(mission.thesis)

    def skill(self, state: str, choice: Choice | None) -> Skill:
        """Return the thesis's skill for a state."""
        if state == "search":
            return ThesisSearchSkill(self._context, self._queue.target)
        if state == "arrive":
            return ThesisArriveSkill(self._context, self._queue.target)
        if state == WAIT.name and choice:
            return ThesisWaitSkill(self._context, choice.wait_s)
        if state == MOVE_TO.name and choice:
            return ThesisMoveSkill(self._context, choice.turn_deg)
        raise KeyError(state)

    def learn(self, failure: Failure) -> None:
        """Do nothing: the thesis keeps no model of the world."""

    def evidence(self, basis: Evidence) -> Evidence:
        """Add nothing: the thesis uses only whether the target was recognised."""
        return basis

    def select(self, evidence: Evidence) -> Choice:
        """Choose by the policy."""
        return checked_choice(self._policy.select, evidence, self._queue.names)
