"""The chances that a profile gave its choices in a mission, and their outcomes.

Definitions: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from behaviors.adaptive.chances import Counts
from behaviors.events import Reason
from behaviors.journal import Record
from behaviors.mission import Mission
from behaviors.profiles.registry import PROFILES, make_policy
from behaviors.recoveries import DETOUR, WAIT
from nxtdrive.recording.decisions import Decision, DecisionResult, decisions, same, weighed_by


@dataclass(frozen=True, slots=True)
class Prediction:
    """A choice whose policy gave it a chance.

    Attributes:
        choice: What was chosen.
        reason: Name of the failure before it.
        chance: As the policy estimated it, 0..1.
        came_true: Whether it achieved its purpose.
        situation: The situation under which its outcome counts; empty if the policy does not learn from it.
    """

    choice: str
    reason: str
    chance: Annotated[float, Field(ge=0, le=1)]
    came_true: bool
    situation: str = ""


def predictions(records: Sequence[Record], profile: str, mission: Mission) -> list[Prediction]:
    """Return the predictions of a mission's journal; none if the profile is not built in or gives no chances."""
    if profile not in PROFILES:
        return []
    policy = make_policy(profile, mission)
    found = []
    for decision in decisions(records):
        choice, came_true = decision.choice, _came_true(decision)
        if choice is None or came_true is None:
            continue
        weighed = (each.weighed for each in weighed_by(policy, decision) if same(each.choice, choice))
        if candidate := next(weighed, None):
            name, chance, situation = choice.kind.name, candidate.chance, candidate.situation
            found.append(Prediction(name, decision.reason, chance, came_true, situation))
    return found


def _came_true(decision: Decision) -> bool | None:
    """Return whether a choice achieved its purpose; None if the mission ended before that was known."""
    outcome, choice = decision.outcome, decision.choice
    if choice is None or outcome.result is DecisionResult.OPEN:
        return None
    if outcome.result is DecisionResult.REACHED:
        return True
    ended = [step.reason for step in outcome.steps if step.state == choice.kind.name]
    if choice.kind is WAIT:
        if Reason.BLOCKED_LONG in ended:
            return False
        return None if outcome.result is DecisionResult.FINISHED and Reason.WAY_CLEAR not in ended else True
    if choice.kind is DETOUR:
        if Reason.NO_WAY in ended:
            return False
        return None if outcome.result is DecisionResult.FINISHED else outcome.detail != decision.reason
    wanted = choice.instead or decision.target
    if any(step.state == "arrive" and step.target == wanted for step in outcome.steps):
        return outcome.detail != decision.reason
    return None if outcome.result is DecisionResult.FINISHED else False


def counts(found: Iterable[Prediction]) -> dict[str, list[int]]:
    """Return how often choices succeeded and how often not, by situation."""
    numbers: dict[str, list[int]] = {}
    for each in found:
        if each.situation:
            numbers.setdefault(each.situation, [0, 0])[0 if each.came_true else 1] += 1
    return dict(sorted(numbers.items()))


def summed(tables: Iterable[Counts]) -> dict[str, list[int]]:
    """Return the sums of several counts."""
    numbers: dict[str, list[int]] = {}
    for table in tables:
        for situation, more in table.items():
            numbers[situation] = [a + b for a, b in zip(numbers.get(situation, (0, 0)), more, strict=True)]
    return dict(sorted(numbers.items()))
