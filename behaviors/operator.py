"""A person who has the last word: confirms what a policy proposes, or chooses something else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from behaviors.evidence import Evidence
from behaviors.recoveries import CHANGE_TARGET, Candidate, Choice, RecoveryPolicy, ThesisPolicy

OPERATORS_WISH = "the operator wished it"


@runtime_checkable
class Weighing(Protocol):
    """A policy that can tell what it has weighed."""

    def options(self, evidence: Evidence) -> Sequence[Candidate]:
        """All candidates for a choice."""
        ...


@dataclass(frozen=True, slots=True)
class OperatorChoice:
    """Something that could be done.

    Attributes:
        choice: What.
        option: What the policy expects of it; None when it does not reckon.
    """

    choice: Choice
    option: Candidate | None = None


@dataclass(frozen=True, slots=True)
class Question:
    """A choice that is due.

    Attributes:
        evidence: What is known.
        proposed: What the policy would do.
        candidates: What could be done; the proposed choice is the first.
    """

    evidence: Evidence
    proposed: Choice
    candidates: tuple[OperatorChoice, ...]


Ask = Callable[[Question], Choice]
"""Returns one of the candidates' choices; `KeyboardInterrupt` ends the mission as Ctrl-C does."""


def candidates(policy: RecoveryPolicy, evidence: Evidence) -> tuple[OperatorChoice, ...]:
    """What could be done as a policy sees it, without giving the target up unless that is what it weighs."""
    if isinstance(policy, Weighing):
        return tuple(OperatorChoice(option.choice, option) for option in policy.options(evidence))
    if isinstance(policy, ThesisPolicy):
        return tuple(OperatorChoice(choice) for choice in policy.recoveries())
    return ()


def question(policy: RecoveryPolicy, evidence: Evidence) -> Question:
    """What a policy proposes, and what could be done instead; another target always can be pursued first."""
    proposed = policy.select(evidence)
    known = candidates(policy, evidence)
    first = next((each for each in known if each.choice == proposed), OperatorChoice(proposed))
    others = [each for each in known if each is not first]
    if proposed.kind is not CHANGE_TARGET:
        others.append(OperatorChoice(Choice(CHANGE_TARGET, OPERATORS_WISH)))
    return Question(evidence, proposed, (first, *others))


class ConfirmedPolicy:
    """A policy whose every choice a person confirms, or replaces by another candidate.

    Args:
        policy: Proposes.
        ask: Asks the person. As long as that takes the robot stands: all services end at rest before a choice is due.
    """

    def __init__(self, policy: RecoveryPolicy, ask: Ask) -> None:
        self._policy = policy
        self._ask = ask

    def select(self, evidence: Evidence) -> Choice:
        """What the person wants."""
        due = question(self._policy, evidence)
        wanted = self._ask(due)
        if wanted == due.proposed:
            return replace(wanted, operator=True)
        return replace(wanted, why=OPERATORS_WISH, operator=True, proposed=due.proposed)
