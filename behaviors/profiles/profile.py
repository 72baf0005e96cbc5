"""What a profile is: the skill for each state, and the choice after each failure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from behaviors.evidence import Evidence
from behaviors.failures import Failure
from behaviors.mission import Mission
from behaviors.recoveries import Choice, RecoveryPolicy
from behaviors.skills import Skill, SkillContext
from behaviors.target_queue import TargetQueue


class Profile(Protocol):
    """A profile at work in one mission."""

    def skill(self, state: str, choice: Choice | None) -> Skill:
        """Return the skill for a state of the mission that was just entered.

        Args:
            state: ``search``, ``arrive``, ``verify`` (only if the profile reports `DOUBTED`), or the recovery that was
                chosen.
            choice: The last choice.

        Raises:
            KeyError: The profile has no skill for such a state.
        """
        ...

    def learn(self, failure: Failure) -> None:
        """Update the profile's model with a failure; called once for each, before `evidence`."""
        ...

    def evidence(self, basis: Evidence) -> Evidence:
        """Complete the evidence for a choice; changes nothing.

        Args:
            basis: The executive's own evidence of the last failure.
        """
        ...

    def select(self, evidence: Evidence) -> Choice:
        """Choose a recovery for this evidence, which the journal has in full."""
        ...


MakeProfile = Callable[[SkillContext, Mission, TargetQueue], Profile]
"""Makes the profile of a mission that begins."""


class ProfileClass(Protocol):
    """The class of a profile."""

    def __call__(
        self, context: SkillContext, mission: Mission, queue: TargetQueue, policy: RecoveryPolicy | None = None
    ) -> Profile:
        """Make the profile of a mission that begins.

        Args:
            context: What to work with.
            mission: What to do.
            queue: Its current target is pursued.
            policy: Chooses in place of the profile's own policy, for a person who confirms its choices.
        """
        ...

    def own_policy(self, mission: Mission) -> RecoveryPolicy:
        """Return the policy by which it chooses, with the mission's numbers; a class method."""
        ...
