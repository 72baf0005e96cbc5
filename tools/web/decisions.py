"""The decisions of a mission as the page shows them: the cause, what was known, the candidates, and the choice."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from behaviors.evidence import Evidence
from behaviors.journal import Record
from behaviors.operator import OperatorChoice
from behaviors.recoveries import RecoveryPolicy
from nxtdrive.recording.decision_costs import CandidateCost, DecisionCosts
from nxtdrive.recording.decisions import Decision, decisions, same, weighed_by
from nxtdrive.recording.explanation import Explanation, explain
from nxtdrive.recording.run_reader import PastRun
from nxtdrive.recording.wording import evidence_lines, reason_words, spaced


def decisions_of(run: PastRun) -> list[dict[str, Any]]:
    """Return all decisions of a run."""
    return explained(explain(run))


def explained(explanation: Explanation) -> list[dict[str, Any]]:
    """Return all decisions of a run that has been explained."""
    return [decided(each.decision, each.candidates, each.what_if) for each in explanation.decisions]


def made(record: Record, policy: RecoveryPolicy) -> dict[str, Any]:
    """Return the decision that a record of kind ``choice`` describes."""
    (decision,) = decisions([record])
    return decided(decision, weighed_by(policy, decision))


def decided(
    decision: Decision, candidates: Iterable[OperatorChoice], what_if: DecisionCosts | None = None
) -> dict[str, Any]:
    """Return a decision as plain values.

    Args:
        decision: As the journal has it.
        candidates: As the run's policy weighs them.
        what_if: The cost of each candidate, by ``nxtdrive what-if``.
    """
    choice, weighed = decision.choice, list(candidates)
    chosen = next((i for i, each in enumerate(weighed) if choice and same(each.choice, choice)), None)
    values = {
        "t": decision.time_s,
        "target": decision.target,
        "failed": reason_words(decision.reason, decision.measured),
        "known": list(evidence_lines(decision.evidence)) if decision.evidence else [],
        "choice": choice.words() if choice else spaced(decision.chose),
        "why": decision.why,
        "operator": bool(choice and choice.operator),
        "candidates": [candidate(each) for each in weighed],
        "chosen": chosen,
    }
    return _with_costs(values, what_if) if what_if else values


def _with_costs(values: dict[str, Any], what_if: DecisionCosts) -> dict[str, Any]:
    """Add the cost of each candidate; candidates that the policy does not weigh come last."""
    known = list(what_if.candidates)
    # two candidates may have the same words; there, too, the chosen one comes first
    for each in sorted(values["candidates"], key=lambda each: each is not values["candidates"][values["chosen"] or 0]):
        if found := next((alternative for alternative in known if alternative.does == each["text"]), None):
            known.remove(found)
            each |= _cost(found, what_if)
    values["candidates"] += [{"text": one.does, "why": "", **_cost(one, what_if)} for one in known]
    return {**values, "what_if": what_if.words()}


def _cost(candidate: CandidateCost, what_if: DecisionCosts) -> dict[str, Any]:
    return {"cost_s": candidate.cost_s, "best": candidate.best and what_if.has_alternative}


def asked(evidence: Evidence, candidates: Iterable[OperatorChoice]) -> dict[str, Any]:
    """Return an open question as plain values."""
    return {
        "target": evidence.target,
        "failed": reason_words(evidence.reason),
        "known": list(evidence_lines(evidence)),
        "candidates": [candidate(each) for each in candidates],
    }


def candidate(each: OperatorChoice) -> dict[str, Any]:
    """Return a candidate as plain values: its duration, its chance, and the expected seconds for a success."""
    values: dict[str, Any] = {"text": each.choice.words(), "why": each.choice.why}
    if weighed := each.weighed:
        seconds, expected_s = _seconds(weighed.seconds), _seconds(weighed.expected_s)
        values |= {"seconds": seconds, "chance": round(weighed.chance, 3), "expected_s": expected_s}
    return values


def _seconds(value: float) -> float | None:
    """Round to what JSON can say: None for a time without end."""
    return round(value, 1) if math.isfinite(value) else None
