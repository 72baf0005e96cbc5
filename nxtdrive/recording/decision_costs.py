"""What the candidates of a run's decisions would have cost, as ``nxtdrive what-if`` found and keeps it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from firmware_protocol.printable import printable
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import read_text
from nxtdrive.recording.run_folder import WHAT_IF

Interval = Annotated[list[float], Field(min_length=3, max_length=3)]
"""A mean and the ends of its interval."""


class CandidateCost(BaseModel):
    """What a candidate would have cost.

    Attributes:
        does: What it does, in words.
        chosen: Whether the run chose it.
        best: Whether it costs least.
        cost_s: Mean seconds to the targets that were open, with its interval.
    """

    model_config = ConfigDict(strict=True, frozen=True)

    does: str
    chosen: bool
    best: bool
    cost_s: Interval


class DecisionCosts(BaseModel):
    """What each candidate of a decision would have cost.

    Attributes:
        decision: Its number in the mission, from 1.
        time_s: Its mission time; ``t`` in the file.
        target: The target it was made for.
        reason: Name of the failure before it.
        futures: Futures tried for each candidate.
        regret_s: Cost of the choice beyond that of the best candidate, without bias.
        biased_regret_s: The same by the lowest mean.
        beyond_best_s: The difference to that mean, with its interval.
        candidates: One is marked as chosen, one as best; they may be the same.
    """

    model_config = ConfigDict(strict=True, frozen=True, populate_by_name=True)

    decision: int
    time_s: float = Field(validation_alias="t", serialization_alias="t")
    target: str
    reason: str
    futures: int
    regret_s: float
    biased_regret_s: float
    beyond_best_s: Interval
    candidates: list[CandidateCost]

    @property
    def has_alternative(self) -> bool:
        """Whether anything else could be chosen; without an alternative the regret says nothing of the choice."""
        return len(self.candidates) > 1

    def words(self) -> str:
        """Describe what the choice and the best candidate cost, and the regret."""
        chosen, best = (next(each for each in self.candidates if getattr(each, mark)) for mark in ("chosen", "best"))
        costs = f"the choice costs {chosen.cost_s[0]:.1f} s to a target on average"
        if not self.has_alternative:
            return f"{costs}; there was no alternative"
        if best is not chosen:
            costs += f"; to {best.does}, {best.cost_s[0]:.1f} s"
        return printable(f"{costs}; regret {self.regret_s:.1f} s")

    def plain(self) -> dict[str, Any]:
        """Return it as plain values, under their names in the file."""
        return self.model_dump(by_alias=True)

    @model_validator(mode="after")
    def _marked(self) -> Self:
        if sum(each.chosen for each in self.candidates) != 1 or sum(each.best for each in self.candidates) != 1:
            raise ValueError("one candidate was chosen, and one is best")
        return self


def decision_costs(folder: Path) -> dict[int, DecisionCosts]:
    """Return what ``nxtdrive what-if`` kept in a run folder, by the number of the decision.

    Returns none if there is no such file, or another one has its name.
    """
    try:
        decisions = parse_object(read_text(folder / WHAT_IF, MAX_BYTES)).get("decisions")
    except ValueError:
        return {}
    found = (_parsed(each) for each in decisions) if isinstance(decisions, list) else ()
    return {each.decision: each for each in found if each is not None}


def _parsed(value: object) -> DecisionCosts | None:
    try:
        return DecisionCosts.model_validate(value)
    except ValidationError:
        return None
