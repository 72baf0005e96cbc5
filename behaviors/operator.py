"""The operator: a person who confirms what a policy proposes, or chooses something else."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Protocol, runtime_checkable

from behaviors.evidence import Evidence
from behaviors.journal import plain
from behaviors.recoveries import CHANGE_TARGET, Candidate, Choice, RecoveryPolicy
from behaviors.return_types import WrongReturn, checked, checked_list, place

OPERATOR_CHOSE = "the operator chose it"
ALTERNATIVE = "possible, though the profile does not propose it"
"""`Choice.why` of the alternatives of a policy that weighs no candidates: it has a reason for its proposal only."""


@runtime_checkable
class WeighingPolicy(Protocol):
    """A policy that can list what it has weighed."""

    def candidates(self, evidence: Evidence) -> Sequence[Candidate]:
        """Return all candidates for a choice."""
        ...


@runtime_checkable
class ListingPolicy(Protocol):
    """A policy that weighs nothing and can list what it may choose."""

    def recoveries(self) -> Sequence[Choice]:
        """Return all its choices, whatever the evidence is."""
        ...


@dataclass(frozen=True, slots=True)
class OperatorChoice:
    """A choice that the operator can make.

    Attributes:
        choice: The choice.
        weighed: What the policy expects of it; None when it does not weigh candidates.
    """

    choice: Choice
    weighed: Candidate | None = None


@dataclass(frozen=True, slots=True)
class Question:
    """A choice that an operator is to confirm or replace.

    Attributes:
        evidence: What is known.
        proposed: What the policy would do.
        candidates: What could be done; the proposed choice comes first.
    """

    evidence: Evidence
    proposed: Choice
    candidates: tuple[OperatorChoice, ...]


def question_values(question: Question) -> dict[str, Any]:
    """Return an open decision as plain values: the evidence, and the candidates, of which the first is proposed."""
    return {
        "target": question.evidence.target,
        "evidence": plain(question.evidence.known()),
        "candidates": [_candidate(number, each) for number, each in enumerate(question.candidates)],
    }


def _candidate(number: int, candidate: OperatorChoice) -> dict[str, Any]:
    values: dict[str, Any] = {"number": number, "does": candidate.choice.words()}
    values |= {name: plain(value) for name, value in candidate.choice.record().items()}
    return values | (candidate.weighed.record() if candidate.weighed else {})


Ask = Callable[[Question], Choice]
"""Returns one of the candidates' choices; `KeyboardInterrupt` ends the mission as Ctrl-C does."""


def candidates(policy: RecoveryPolicy, evidence: Evidence) -> tuple[OperatorChoice, ...]:
    """Return the candidates of a policy; giving the target up is among them only if the policy weighs that."""
    if isinstance(policy, WeighingPolicy):
        weighed = checked_list(policy.candidates, Candidate, evidence)
        for each in weighed:
            if wrong := _wrong(each):
                raise WrongReturn(f"{place(policy.candidates)} returned a candidate with {wrong}")
        return tuple(OperatorChoice(each.choice, each) for each in weighed)
    if isinstance(policy, ListingPolicy):
        return tuple(OperatorChoice(choice) for choice in checked_list(policy.recoveries, Choice))
    return ()


def _wrong(candidate: Candidate) -> str:
    """Return what is wrong with a candidate, which may come from a profile of another package, or an empty string."""
    choice, seconds, chance = candidate.choice, candidate.seconds, candidate.chance
    if not isinstance(choice, Choice):
        return f"{type(choice).__name__}, not a Choice"
    if not isinstance(seconds, Real) or math.isnan(seconds):
        return f"seconds of {seconds!r}, not a number"
    if not isinstance(chance, Real) or not 0 <= chance <= 1:
        return f"a chance of {chance!r}, not one from 0 to 1"
    return ""


def question(policy: RecoveryPolicy, evidence: Evidence) -> Question:
    """Return a policy's proposal and the alternatives; changing the target is always possible."""
    proposed = checked(policy.select, Choice, evidence)
    known = candidates(policy, evidence)
    first = next((each for each in known if each.choice == proposed), OperatorChoice(proposed))
    others = [
        each if each.weighed else OperatorChoice(replace(each.choice, why=ALTERNATIVE))
        for each in known
        if each is not first
    ]
    if proposed.kind is not CHANGE_TARGET:
        others.append(OperatorChoice(Choice(CHANGE_TARGET, ALTERNATIVE)))
    return Question(evidence, proposed, (first, *others))


class ConfirmedPolicy:
    """A policy each of whose choices a person confirms or replaces by another candidate.

    Args:
        policy: Proposes.
        ask: Asks the person. Meanwhile the robot stands still: every skill ends at rest before a choice is made.
    """

    def __init__(self, policy: RecoveryPolicy, ask: Ask) -> None:
        self._policy = policy
        self._ask = ask

    def select(self, evidence: Evidence) -> Choice:
        """Return the person's choice."""
        asked = question(self._policy, evidence)
        wanted = self._ask(asked)
        if wanted == asked.proposed:
            return replace(wanted, operator=True)
        return replace(wanted, why=OPERATOR_CHOSE, operator=True, proposed=asked.proposed)
