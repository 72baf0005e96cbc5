"""The runs of a folder, for the list and the replay."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from pydantic import BaseModel, FiniteFloat

from behaviors.executive import Ending
from firmware_protocol.errors import ConfigError
from input_files.json_text import parse_object
from input_files.plain import read_text
from nxtdrive.recording.camera_index import FILE_NAME, read_frames
from nxtdrive.recording.run_folder import CAMERA, JOURNAL, MAP, SUMMARY
from nxtdrive.recording.run_reader import changed_s, journals_in, read_run

from .replay_data import replay_data

FILES = (MAP, JOURNAL, SUMMARY)
"""Files of a run that may be downloaded, besides its pictures."""

MAX_SUMMARY_BYTES = 1_000_000
ACTIVE_RUN_S = 10.0
"""A journal that was written to less than this time ago, as by `nxtdrive run` in a terminal, is of a run under way."""


class _Target(BaseModel):
    target: str
    outcome: str


class _Summary(BaseModel):
    """The part of a summary that the list shows."""

    mission: str = ""
    ending: str
    achieved: bool
    duration_s: FiniteFloat | None = None
    targets: list[_Target] = []


class Runs:
    """The runs in a folder.

    Args:
        folder: Each folder in it with a journal is a run.
        now: Returns the time of the file system's clock, seconds.
    """

    def __init__(self, folder: Path, now: Callable[[], float] = time.time) -> None:
        self._folder = folder
        self._now = now

    def names(self) -> list[str]:
        """Return the names of the runs, the newest first."""
        journals = journals_in(self._folder)
        return [path.parent.name for path in journals if path.parent.name.isprintable()]

    def listed(self, running: str = "") -> list[dict[str, Any]]:
        """Return name, mission, result, duration and targets of each run, the newest first.

        Args:
            running: Name of the run whose mission this program pursues, which may be paused.
        """
        return [self._line(name, is_own=name == running) for name in self.names()]

    def replay(self, name: str) -> dict[str, Any]:
        """Return the data for the replay of a run.

        Raises:
            KeyError: There is no such run.
            ConfigError: It cannot be read.
        """
        path = self._path(name)
        pictures = f"runs/{quote(name, safe='')}/{CAMERA}"
        return replay_data(name, read_run(path), read_frames(path), lambda frame: f"{pictures}{frame.file}")

    def file(self, name: str, file: str) -> Path:
        """Return the path of one of a run's files.

        Args:
            name: The run's.
            file: One of `FILES`, or ``camera/`` with the name of a picture.

        Raises:
            KeyError: There is no such run, or it has no such file.
        """
        path = self._path(name) / file
        if not (file in FILES or re.fullmatch(CAMERA + FILE_NAME, file)) or not os.path.isfile(path):
            raise KeyError(file)
        return path

    def _path(self, name: str) -> Path:
        path = self._folder / name
        if (
            path.parent != self._folder or name == ".." or not os.path.exists(path / JOURNAL)
        ):  # also false for a name no folder has
            raise KeyError(name)
        return path

    def _line(self, name: str, *, is_own: bool) -> dict[str, Any]:
        path = self._folder / name
        ending = "running" if is_own or self._grows(path) else "unfinished"
        return {"name": name, "map": (path / MAP).is_file(), **(_ended(path) or _unfinished(path, ending))}

    def _grows(self, path: Path) -> bool:
        """Return whether a program still writes a run."""
        is_recent = abs(self._now() - changed_s(path / JOURNAL)) < ACTIVE_RUN_S
        return is_recent and not os.path.lexists(path / SUMMARY)


def _ended(path: Path) -> dict[str, Any] | None:
    """Return the summary of a run; None without one that can be read."""
    try:
        return _Summary.model_validate(parse_object(read_text(path / SUMMARY, MAX_SUMMARY_BYTES))).model_dump()
    except ValueError:
        return None


def _unfinished(path: Path, ending: str) -> dict[str, Any]:
    """Return the state of a run without a summary, by its journal: `ending`, unless it has an end or is damaged."""
    try:
        run = read_run(path)
    except (ConfigError, OSError):
        return _Summary(ending="unreadable", achieved=False).model_dump()
    ending = str(run.end.data.get("ending")) if run.end else ending
    achieved, last_s = ending == Ending.ACHIEVED, run.records[-1].time_s
    return _Summary(mission=run.name, ending=ending, achieved=achieved, duration_s=last_s).model_dump()
