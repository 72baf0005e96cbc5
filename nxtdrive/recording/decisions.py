"""The decisions of a run, from its journal: what failed, what was known, what was chosen, and the outcome."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any

from behaviors.chart import MISSION_STATES
from behaviors.events import Event
from behaviors.evidence import Evidence, evidence_from
from behaviors.journal import Record, RecordKind, end_of
from behaviors.operator import OperatorChoice, WeighingPolicy, candidates
from behaviors.recoveries import Choice, RecoveryPolicy, choice_from
from behaviors.return_types import checked

WEIGHED = ("blocker", "here", "viewpoints")
"""Evidence that only a policy which weighs candidates has."""
TOLERANCE_S = TOLERANCE_DEG = 0.05
TOLERANCE_MM = 1.0
"""Journals are rounded; numbers that differ by less are equal."""


class DecisionResult(StrEnum):
    """The outcome of a decision, in a word."""

    FAILED = "failed_again"
    REACHED = "reached"
    FINISHED = "mission_ended"
    OPEN = "journal_ends"


@dataclass(frozen=True, slots=True)
class StateSpan:
    """A state the mission was in after a decision.

    Attributes:
        state: Its name.
        target: What was pursued.
        seconds: How long.
        reason: Why it ended; empty when the chart went on by itself or the journal does not say.
    """

    state: str
    target: str
    seconds: float
    reason: str


@dataclass(frozen=True, slots=True)
class DecisionOutcome:
    """The outcome of a decision, up to the next one.

    Attributes:
        result: In a word.
        target: The target it is about.
        detail: The next failure's name, or how the mission ended.
        seconds: How long it took.
        steps: The states in between.
    """

    result: DecisionResult
    target: str
    detail: str
    seconds: float
    steps: tuple[StateSpan, ...]


@dataclass(frozen=True, slots=True)
class Decision:
    """A choice of recovery that was made.

    Attributes:
        time_s: Mission time.
        target: What was pursued.
        reason: Name of the failure.
        measured: What was measured then.
        known: The evidence as the journal has it.
        evidence: The same; None if this version does not understand it.
        chose: The choice's name in the journal.
        why: The reason given for it.
        choice: The choice; None if this version does not support it.
        outcome: What it led to.
    """

    time_s: float
    target: str
    reason: str
    measured: Mapping[str, Any]
    known: Mapping[str, Any]
    evidence: Evidence | None
    chose: str
    why: str
    choice: Choice | None
    outcome: DecisionOutcome

    @property
    def weighed(self) -> bool:
        """Whether the evidence has the alternatives."""
        return any(self.known.get(name) for name in WEIGHED)


@dataclass(frozen=True, slots=True)
class Replay:
    """What a policy would have chosen with a decision's evidence.

    Attributes:
        choice: Its choice; None when the journal does not allow one.
        differs: Whether it differs from what was chosen.
        why_not: Why there is none, or an empty string.
    """

    choice: Choice | None
    differs: bool = False
    why_not: str = ""


def decisions(records: Sequence[Record]) -> list[Decision]:
    """Return every decision of a journal, in order."""
    chosen = [i for i, record in enumerate(records) if record.kind is RecordKind.CHOICE]
    # a failure is written just after the choice it led to, since the chart chooses while it enters `select`
    failed = [_failure_at(records, i, end) for i, end in pairwise([*chosen, len(records)])]
    spans = pairwise([*failed, len(records)])
    return [
        _decision(records[i], records[at] if at > i else None, records[at + 1 : end + 1])
        for i, (at, end) in zip(chosen, spans, strict=True)
    ]


def weighed_by(policy: RecoveryPolicy | None, decision: Decision) -> tuple[OperatorChoice, ...]:
    """Return the candidates of a decision as a policy weighs them, and the choice if it is none of them."""
    chosen = decision.choice
    if decision.evidence is None or not decision.weighed or not isinstance(policy, WeighingPolicy):
        return ()
    found = candidates(policy, decision.evidence)
    if chosen is None or any(same(each.choice, chosen) for each in found):
        return found
    return (*found, OperatorChoice(chosen))


def replay(policy: RecoveryPolicy | None, decision: Decision) -> Replay:
    """Give a decision's evidence to a policy; None is one that is not known or cannot be loaded."""
    if decision.evidence is None:
        return Replay(None, why_not="this version does not understand the journal's evidence")
    if policy is None:
        return Replay(None, why_not="the profile is not known or cannot be loaded here")
    if isinstance(policy, WeighingPolicy) and not decision.weighed:
        return Replay(None, why_not="the journal has neither the obstacle nor other places to look from")
    choice = checked(policy.select, Choice, decision.evidence)
    return Replay(choice, differs=decision.choice is None or not same(choice, decision.choice))


def same(one: Choice, other: Choice) -> bool:
    """Return whether two choices have the same effect."""
    return (
        one.kind is other.kind
        and one.instead == other.instead
        and abs(one.wait_s - other.wait_s) < TOLERANCE_S
        and abs(one.turn_deg - other.turn_deg) < TOLERANCE_DEG
        and len(one.route) == len(other.route)
        and all(
            abs(here[0] - there[0]) < TOLERANCE_MM and abs(here[1] - there[1]) < TOLERANCE_MM
            for here, there in zip(one.route, other.route, strict=True)
        )
    )


def _failure_at(records: Sequence[Record], choice: int, end: int) -> int:
    """Return the index of a choice's transition into `select`; the choice's own if there is none."""
    return next((i for i in range(choice, end) if _enters(records[i], "select")), choice)


def _enters(record: Record, state: str) -> bool:
    return record.kind is RecordKind.TRANSITION and record.data.get("to") == state


def _decision(record: Record, failure: Record | None, after: Sequence[Record]) -> Decision:
    data = record.data
    known = _mapping(data.get("evidence"))
    try:
        evidence = evidence_from(record.target, known)
    except ValueError:
        evidence = None
    try:
        choice = choice_from(data)
    except (KeyError, TypeError, ValueError):
        choice = None
    return Decision(
        time_s=record.time_s,
        target=record.target,
        reason=str(known.get("reason", "")),
        measured=_mapping(failure.data.get("evidence")) if failure else {},
        known=known,
        evidence=evidence,
        chose=str(data.get("choice", "")),
        why=str(data.get("why", "")),
        choice=choice,
        outcome=_outcome(record, after),
    )


def _outcome(choice: Record, after: Sequence[Record]) -> DecisionOutcome:
    steps: list[StateSpan] = []
    entered: Record | None = None

    def outcome(result: DecisionResult, record: Record, detail: str = "") -> DecisionOutcome:
        return DecisionOutcome(result, record.target, detail, record.time_s - choice.time_s, tuple(steps))

    for record in after:
        if not _entered(record):
            continue
        reason = str(record.data.get("reason", ""))
        if entered is not None:
            seconds = record.time_s - entered.time_s
            steps.append(StateSpan(_entered(entered), entered.target, seconds, reason))
        if _enters(record, "select"):
            return outcome(DecisionResult.FAILED, record, reason)
        if _enters(record, "reached"):
            return outcome(DecisionResult.REACHED, record)
        if _enters(record, "finished"):
            end = end_of(after)
            return outcome(DecisionResult.FINISHED, record, str(end.data.get("ending", "")) if end else "")
        entered = record
    last = after[-1] if after else choice
    if entered is not None:
        steps.append(StateSpan(_entered(entered), entered.target, last.time_s - entered.time_s, ""))
    return outcome(DecisionResult.OPEN, last)


def _entered(record: Record) -> str:
    """Return the other state of the mission region that a transition entered, or an empty string."""
    data = record.data
    if record.kind is not RecordKind.TRANSITION or data.get("to") == data.get("source"):
        return ""
    if data.get("event") in (Event.RESUME, Event.RETREATED):
        return record.state  # the transition leads to where it was before
    to = str(data.get("to"))
    return to if to in MISSION_STATES else ""


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}
