"""The result of one mission of a sweep, which is a line of the sweep's file."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated, Any, Self

from pydantic import AfterValidator, AliasChoices, BaseModel, ConfigDict, Field, field_serializer, model_validator

from behaviors.executive import Ending
from nxtdrive.recording.predictions import Prediction

from .causes import ChoiceEvaluation
from .metrics import TargetResult

Key = tuple[str, int, str, str, str]
"""Class, seed, agent, how targets are seen (`vision`), and the digest of the robot's description."""
OF_WHOLE_MISSIONS = {"duration_s", "contacts"}
USUAL_TARGETS = 2
"""Existing targets of most classes of scenarios."""


def _timed(target: TargetResult) -> TargetResult:
    """Refuse a target that was reached at no time, or not reached at some."""
    if target.success == (target.time_s is None):
        raise ValueError("success and time_s contradict each other")
    return target


class MissionResult(BaseModel):
    """The result of one mission; docs/evaluation.md explains the fields under their names in the file.

    A mission that broke has no targets but their number, `unreached`, and none of the values after them, nor a
    duration or contacts. Values with a default are not in files of earlier versions, which have `vision` as `eyes`.
    """

    model_config = ConfigDict(strict=True, frozen=True, populate_by_name=True)

    episode_index: int
    kind: str = Field(validation_alias="class", serialization_alias="class")
    seed: int
    agent: str = Field(validation_alias="policy", serialization_alias="policy")
    vision: str = Field(validation_alias=AliasChoices("vision", "eyes"))
    robot: str = ""
    success: bool
    sum_reward: float
    max_reward: float
    done: bool
    ending: Ending
    error: str
    unreached: int = USUAL_TARGETS
    duration_s: float = 0.0
    contacts: int = 0
    targets: list[Annotated[TargetResult, AfterValidator(_timed)]]
    recognition_s: list[float] = []
    choices: list[ChoiceEvaluation] = []
    transitions: list[str] = []
    longest_run: int = 0
    soonest_s: float | None = None
    chances: list[Prediction] = []

    @property
    def key(self) -> Key:
        """Identify the mission across sweeps."""
        return self.kind, self.seed, self.agent, self.vision, self.robot

    @property
    def broke(self) -> bool:
        """Whether an error ended the mission before it could be evaluated."""
        return self.ending is Ending.BROKEN

    @property
    def existing(self) -> list[TargetResult]:
        """The targets that exist."""
        return [target for target in self.targets if target.reachable]

    def to_json(self) -> str:
        """Return the mission's line of JSON, without the end of the line."""
        return json.dumps(self.model_dump(mode="json", by_alias=True, exclude_unset=True), ensure_ascii=False)

    @field_serializer("choices")
    def _with_verdicts(self, choices: list[ChoiceEvaluation]) -> list[dict[str, Any]]:
        return [{**asdict(choice), "fits": choice.fits} for choice in choices]

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Refuse a mission that was evaluated but lacks its duration or contacts."""
        if not self.broke and (missing := sorted(OF_WHOLE_MISSIONS - self.model_fields_set)):
            raise ValueError(f"{missing[0]} is missing")
        return self
