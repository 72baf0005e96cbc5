"""Why a robot did what it did, and what another policy would have done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError

from behaviors.mission import Mission, MissionError
from behaviors.operator import OperatorChoice
from behaviors.profiles.registry import make_policy
from behaviors.recoveries import RecoveryPolicy
from firmware_protocol.printable import printable
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import read_text
from nxtdrive.recording.decisions import Decision, Replay, decisions, profile_of, replay, weighed_by
from nxtdrive.recording.run_folder import WHAT_IF
from nxtdrive.recording.run_reader import PastRun

DEFAULTS = Mission.model_validate(
    {"mission": {"targets": ["any"]}, "target": {"any": {"detector": "color", "color": "red"}}}
)
"""Used for a journal without a mission: only the profiles' parameters are needed."""


@dataclass(frozen=True, slots=True)
class Explained:
    """One decision.

    Attributes:
        decision: As the journal has it.
        candidates: The alternatives as the run's policy weighs them; empty if it does not weigh.
        replay: What the other policy would have chosen with its evidence.
        what_if: The cost of each candidate by ``nxtdrive what-if``; None if that was not run.
    """

    decision: Decision
    candidates: tuple[OperatorChoice, ...]
    replay: Replay
    what_if: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Explanation:
    """A whole run.

    Attributes:
        run: What was read.
        profile: The profile that made the decisions.
        policy: The profile whose policy `Explained.replay` is about; the same if no other was given.
        decisions: All of them, in order.
        unavailable: Why the run's own policy cannot be loaded here; then no decision has candidates.
    """

    run: PastRun
    profile: str
    policy: str
    decisions: tuple[Explained, ...]
    unavailable: str = ""


class _Candidate(BaseModel, strict=True):
    does: str
    chosen: bool
    best: bool
    cost_s: list[float] = Field(min_length=1)


class _WhatIf(BaseModel, strict=True):
    decision: int
    regret_s: float
    candidates: list[_Candidate]


def what_ifs(folder: Path) -> dict[int, Mapping[str, Any]]:
    """Return the results of ``nxtdrive what-if`` in a run folder, by the number of the decision, from 1.

    Returns none if there is no such file, or another one has its name.
    """
    try:
        decisions = parse_object(read_text(folder / WHAT_IF, MAX_BYTES)).get("decisions")
    except ValueError:
        return {}
    return {each["decision"]: each for each in decisions if _is_what_if(each)} if isinstance(decisions, list) else {}


def _is_what_if(value: Any) -> bool:  # noqa: ANN401 - whatever the file has
    try:
        candidates = _WhatIf.model_validate(value).candidates
    except ValidationError:
        return False
    return any(each.chosen for each in candidates) and any(each.best for each in candidates)


def explain(run: PastRun, policy: str | None = None) -> Explanation:
    """Explain a run.

    Args:
        run: As read.
        policy: Name of the profile whose policy gets each decision's evidence again; the run's own when None.

    Raises:
        MissionError: The class of `policy` cannot be loaded; that of the run's own need not be here.
    """
    mission = run.mission or DEFAULTS
    made = decisions(run.records)
    profile = profile_of(run.mission, made)
    own, unavailable = _own_policy(profile, mission)
    asked = make_policy(policy, mission) if policy else own
    known = what_ifs(run.path.parent)
    explained = (
        Explained(each, weighed_by(own, each), replay(asked, each), known.get(i)) for i, each in enumerate(made, 1)
    )
    return Explanation(run, profile, policy or profile, tuple(explained), unavailable)


def _own_policy(profile: str, mission: Mission) -> tuple[RecoveryPolicy | None, str]:
    """Return a run's own policy, or why it cannot be loaded here: the run may come from another folder or computer."""
    try:
        return make_policy(profile, mission), ""
    except MissionError as error:
        return None, str(error)


def what_if_words(decision: Mapping[str, Any]) -> str:
    """Say what ``nxtdrive what-if`` found: the costs of the choice and of the best candidate, and the regret."""
    chosen, best = (next(each for each in decision["candidates"] if each[mark]) for mark in ("chosen", "best"))
    costs = f"the choice costs {chosen['cost_s'][0]:.1f} s to a target on average"
    if best is not chosen:
        costs += f"; to {best['does']}, {best['cost_s'][0]:.1f} s"
    return printable(f"{costs}; regret {decision['regret_s']:.1f} s")
