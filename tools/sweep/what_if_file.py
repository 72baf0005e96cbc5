"""The file of ``nxtdrive what-if --out``: one line of JSON per mission."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from firmware_protocol.errors import ConfigError
from input_files.json_text import parse_object

from .result_file import whole_lines

BEGIN = b'{"run": '
"""How each line begins, even one that an interruption cut short."""

Key = tuple[str, int | None, int | None, int | None]
"""Mission, decision, size of the sample and number of futures."""


class _Model(BaseModel):
    model_config = ConfigDict(strict=True)


class _Candidate(_Model):
    does: str
    chosen: bool
    best: bool
    cost_s: list[float] = Field(min_length=3, max_length=3)


class _Decision(_Model):
    """The keys of a decision that are shown or summed up."""

    decision: int
    t: float
    target: str
    reason: str
    regret_s: float
    biased_regret_s: float
    candidates: list[_Candidate]


class _Mission(_Model):
    run: str
    decision: int | None = None
    sample: int | None = None
    futures: int | None = None
    decisions: list[_Decision]


def key_of(mission: Mapping[str, Any]) -> Key:
    """Return the identity of a result: the mission, and what was asked about it."""
    return mission["run"], mission.get("decision"), mission.get("sample"), mission.get("futures")


def read_missions(path: Path) -> dict[Key, dict[str, Any]]:
    """Return the missions of a file by `key_of`, except a last one that an interruption cut short.

    Raises:
        ConfigError: The file cannot be read, or is not of what-if.
    """
    lines = whole_lines(path, BEGIN, lambda number: _foreign(path, number))
    missions = [_mission(path, number, line) for number, line in enumerate(lines, start=1)]
    return {key_of(each): each for each in missions}


def _mission(path: Path, number: int, line: bytes) -> dict[str, Any]:
    try:
        _Mission.model_validate_json(line)
        return parse_object(line.decode())
    except (ValidationError, ValueError):
        raise _foreign(path, number) from None


def _foreign(path: Path, line: int) -> ConfigError:
    return ConfigError(f"{path} is not from nxtdrive what-if (line {line}).", remedy="Choose another file with --out.")
