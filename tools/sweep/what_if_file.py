"""The file of ``nxtdrive what-if --out``: one line of JSON per mission."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from firmware_protocol.errors import ConfigError
from input_files.json_text import parse_object
from nxtdrive.recording.decision_costs import DecisionCosts

from .result_file import whole_lines

BEGIN = b'{"run": '
"""How each line begins, even one that an interruption cut short."""

Key = tuple[str, int | None, int | None, int | None]
"""Mission, decision, size of the sample and number of futures."""


class ExaminedMission(BaseModel):
    """A mission, what was asked about it (None: not limited), and the decisions that were examined."""

    model_config = ConfigDict(strict=True, frozen=True)

    run: str
    decision: int | None = None
    sample: int | None = None
    futures: int | None = None
    decisions: list[DecisionCosts]

    @property
    def key(self) -> Key:
        """Identify the result: the mission, and what was asked about it."""
        return self.run, self.decision, self.sample, self.futures

    def plain(self) -> dict[str, Any]:
        """Return it as plain values, under their names in the file."""
        return self.model_dump(by_alias=True, exclude_unset=True)

    def to_json(self) -> str:
        """Return the mission's line of JSON, without the end of the line."""
        return json.dumps(self.plain(), ensure_ascii=False)


def read_missions(path: Path) -> dict[Key, ExaminedMission]:
    """Return the missions of a file by their keys, except a last one that an interruption cut short.

    Raises:
        ConfigError: The file cannot be read, or is not of what-if.
    """
    lines = whole_lines(path, BEGIN, lambda number: _foreign(path, number))
    missions = [_mission(path, number, line) for number, line in enumerate(lines, start=1)]
    return {each.key: each for each in missions}


def _mission(path: Path, number: int, line: bytes) -> ExaminedMission:
    try:
        parse_object(line.decode())
        return ExaminedMission.model_validate_json(line)
    except ValueError:
        raise _foreign(path, number) from None


def _foreign(path: Path, line: int) -> ConfigError:
    return ConfigError(f"{path} is not from nxtdrive what-if (line {line}).", remedy="Choose another file with --out.")
