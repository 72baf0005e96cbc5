"""The file of ``nxtdrive what-if --out``: one line of JSON per mission."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from nxtdrive.recording.decision_costs import DecisionCosts

from .result_file import read_lines

Key = tuple[str, int | None, int | None, int | None, bool]
"""Mission, decision, size of the sample, number of futures, and whether unseen targets hang elsewhere in each."""


class ExaminedMission(BaseModel):
    """A mission, what was asked about it (None: not limited), and the decisions that were examined."""

    model_config = ConfigDict(strict=True, frozen=True)

    run: str
    decision: int | None = None
    sample: int | None = None
    futures: int | None = None
    redraw_unseen: bool = False
    decisions: list[DecisionCosts]

    @property
    def key(self) -> Key:
        """Identify the result: the mission, and what was asked about it."""
        return self.run, self.decision, self.sample, self.futures, self.redraw_unseen

    def plain(self) -> dict[str, Any]:
        """Return it as plain values, under their names in the file."""
        return self.model_dump(by_alias=True, exclude_unset=True)

    def to_json(self) -> str:
        """Return the mission's line of JSON, without the end of the line."""
        return json.dumps(self.plain(), ensure_ascii=False)


def read_missions(path: Path) -> dict[Key, ExaminedMission]:
    """Return the missions of a file by their keys, as `read_lines` reads them."""
    return {each.key: each for each in read_lines(path, ExaminedMission, "from nxtdrive what-if")}
