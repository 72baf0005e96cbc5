"""The folder of one run: mission, journal, summary, map, and the camera's frames and video.

The mission is written when the run begins, and journal and frames as they come, so that a run that is killed leaves
everything up to that moment. The rest is written when the run ends, however it ends.
"""

from __future__ import annotations

import errno
import json
import os
import re
import sys
import unicodedata
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from behaviors.executive import Report
from behaviors.journal import Record
from behaviors.mission import Mission
from behaviors.mission.robot import MEASURED_PLACE
from firmware_protocol.errors import ConfigError
from nxtdrive.recording.output_file import write_file

MISSION, JOURNAL, SUMMARY, MAP, VIDEO = "mission.json", "journal.jsonl", "summary.json", "map.png", "camera.webm"
CAMERA = "camera/"
"""Folder of the camera's frames in a run folder."""
WHAT_IF = "what-if.json"
"""Results of ``nxtdrive what-if``."""
RESERVE, RESERVED = "summary.reserved", 4096
"""File and bytes that keep room for the summary until the run ends."""
LONGEST_STEM = 80
"""Bytes, in UTF-8, of a folder's name before its number."""


class RunFolder:
    """The files of one run.

    Args:
        path: An existing folder; files in it are overwritten.

    Attributes:
        path: As given.
        records: Those of the journal so far.
        mission: What `write_mission` wrote; None before.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records: list[Record] = []
        self.mission: Mission | None = None
        self._journal: TextIO = (path / JOURNAL).open("w", encoding="utf-8", newline="\n")
        self._reserve = path / RESERVE
        with suppress(OSError):
            write_file(self._reserve, bytes(RESERVED))

    def __call__(self, record: Record) -> None:
        """Write one record to the journal, immediately."""
        self.records.append(record)
        self._journal.write(record.to_json() + "\n")
        self._journal.flush()

    def write_mission(self, mission: Mission) -> None:
        """Write ``mission.json``: the mission with all parameters it runs with; it reads as the same mission."""
        self.mission = mission
        guesses = MEASURED_PLACE - mission.camera.model_fields_set
        text = mission.model_dump_json(indent=2, exclude={"camera": set(guesses)})
        write_file(self.path / MISSION, (text + "\n").encode())

    def close(self) -> None:
        """Close the journal; if the folder was removed in the meantime, recreate it and its files."""
        self._journal.close()
        if not os.path.exists(self.path / JOURNAL):
            self.path.mkdir(parents=True, exist_ok=True)
            journal = "".join(record.to_json() + "\n" for record in self.records)
            write_file(self.path / JOURNAL, journal.encode())
            if self.mission is not None:
                self.write_mission(self.mission)

    def write_summary(self, report: Report | None, error: str, details: dict[str, object]) -> None:
        """Write ``summary.json``, on a full disk in the space that was reserved for it, without `path` if that is long.

        Args:
            report: The mission's result; None when it broke.
            error: Why it broke or ended early, or an empty string.
            details: Further entries: mission, address, camera, seed.
        """
        self._reserve.unlink(missing_ok=True)
        values = summary(report, error, details)
        try:
            self._write_summary(values)
        except OSError:
            if values.pop("path", None) is None:
                raise
            self._write_summary(values)

    def _write_summary(self, values: dict[str, object]) -> None:
        write_file(self.path / SUMMARY, (json.dumps(values, indent=2, ensure_ascii=False) + "\n").encode())


def summary(report: Report | None, error: str, details: dict[str, object]) -> dict[str, object]:
    """Return the summary of a run as plain values, as ``summary.json`` and ``--json`` have it."""
    if report is None:
        return {"ending": "broken", "achieved": False, "error": error, **details}
    return {
        "ending": report.ending.value,
        "achieved": report.achieved,
        "error": report.error or error,
        "duration_s": round(report.duration_s, 3),
        "targets": [
            {
                "target": progress.target,
                "outcome": progress.outcome.value,
                "time_s": None if progress.time_s is None else round(progress.time_s, 3),
                "searches": progress.attempts,
            }
            for progress in report.targets
        ],
        "path": list(report.path),
        **details,
    }


def check_parent(parent: Path) -> None:
    """Refuse a folder in which no run could be kept, before anything is done for one.

    Args:
        parent: As for `new_run_folder`; need not exist.

    Raises:
        ConfigError: It, or the nearest existing path above it, is not a folder or cannot be written to.
    """
    nearest = next(path for path in (parent, *parent.parents) if os.path.lexists(path))
    if not os.path.isdir(nearest):
        raise _unusable(parent, errno.ENOTDIR)
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise _unusable(parent, errno.EACCES)


def new_run_folder(parent: Path, mission_name: str) -> RunFolder:
    """Make the next numbered folder for a mission, ``lena-then-rilakkuma-001`` and so on.

    Args:
        parent: Where; made if it is missing.
        mission_name: The folder gets its letters and digits, in lower case.

    Raises:
        ConfigError: The folder cannot be made.
    """
    stem = _stem(mission_name)
    try:
        parent.mkdir(parents=True, exist_ok=True)
        number = _highest(os.listdir(parent), stem)
        while True:
            number += 1
            path = parent / f"{stem}-{number:03d}"
            with suppress(FileExistsError):  # a run that began at the same time has taken the number
                path.mkdir()
                return RunFolder(path)
    except OSError as error:
        raise _unusable(parent, error.errno) from None


def _unusable(parent: Path, code: int | None) -> ConfigError:
    return ConfigError(
        f"{parent}: cannot keep the run there ({os.strerror(code or errno.EIO)}).",
        remedy="Choose another folder with --out.",
    )


def _stem(mission_name: str) -> str:
    """Return the letters and digits of a name, of any script that the file system can have; hyphens for the rest."""
    encoding = sys.getfilesystemencoding()
    name = unicodedata.normalize("NFC", mission_name).lower().encode(encoding, "replace").decode(encoding)
    kept = "".join(each if unicodedata.category(each)[0] in "LMN" else " " for each in name)
    cut = "-".join(kept.split()).encode()[:LONGEST_STEM].decode(errors="ignore")
    return cut.strip("-") or "mission"


def _highest(names: Sequence[str], stem: str) -> int:
    numbers = [re.fullmatch(rf"{re.escape(stem)}-(\d+)", name) for name in names]
    return max((int(match[1]) for match in numbers if match), default=0)
