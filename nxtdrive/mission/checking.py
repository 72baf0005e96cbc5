"""Everything that can be found wrong with a mission file before it runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.mission.setup import build_detectors, load


@dataclass(slots=True)
class Findings:
    """What was found in a mission file.

    Attributes:
        mistakes: Why it cannot run.
        warnings: What is allowed and hardly meant.
    """

    mistakes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def check_mission(path: Path) -> Findings:
    """Check a mission file, and try the pictures and cascades it names."""
    try:
        build_detectors(load(path))
    except ConfigError as error:
        head, *rest = str(error).split("\n")
        return Findings([line.strip() for line in rest] or [head.removeprefix(f"{path}: ")])
    return Findings()
