"""The runs of a folder, for the list and the replay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from behaviors.journal import Kind
from input_files.json_text import parse_object
from input_files.plain import InputFileError, read_text
from nxtdrive.recording.progress_lines import ProgressLines
from nxtdrive.recording.run_folder import JOURNAL, MAP, SUMMARY
from nxtdrive.recording.run_reader import PastRun, read_run

from .chart import chart, recoveries
from .decisions import decisions_of

FILES = (MAP, JOURNAL, SUMMARY)
"""What of a run may be fetched as it is."""


MAX_SUMMARY_BYTES = 1_000_000


class Runs:
    """The runs in a folder.

    Args:
        folder: Each folder in it with a journal is a run.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def names(self) -> list[str]:
        """Return the names of the runs, the newest first."""
        journals = sorted(self._folder.glob(f"*/{JOURNAL}"), key=lambda path: path.stat().st_mtime, reverse=True)
        return [path.parent.name for path in journals]

    def listed(self) -> list[dict[str, Any]]:
        """Return name, mission, result, duration and targets of each run, the newest first."""
        return [self._line(name) for name in self.names()]

    def replay(self, name: str) -> dict[str, Any]:
        """Return everything that the page needs to replay a run.

        Raises:
            KeyError: There is no such run.
            ConfigError: It cannot be read.
        """
        run = read_run(self._path(name))
        return {
            "name": name,
            "mission": run.name,
            "chart": chart(),
            "recoveries": recoveries(),
            "records": [record.values() for record in run.records],
            "lines": _lines(run),
            "decisions": decisions_of(run),
        }

    def file(self, name: str, file: str) -> Path:
        """Return the path of one of a run's files.

        Raises:
            KeyError: There is no such run, or it has no such file.
        """
        path = self._path(name) / file
        if file not in FILES or not path.is_file():
            raise KeyError(file)
        return path

    def _path(self, name: str) -> Path:
        if name not in self.names():
            raise KeyError(name)
        return self._folder / name

    def _line(self, name: str) -> dict[str, Any]:
        try:
            summary = parse_object(read_text(self._folder / name / SUMMARY, MAX_SUMMARY_BYTES))
            shown = {key: summary.get(key) for key in ("mission", "ending", "achieved", "duration_s", "targets")}
        except (InputFileError, ValueError):
            shown = {"mission": "", "ending": "unfinished", "achieved": False, "duration_s": None, "targets": []}
        return {"name": name, "map": (self._folder / name / MAP).is_file(), **shown}


def _lines(run: PastRun) -> list[dict[str, Any]]:
    """Return what `nxtdrive run` printed, each line with its time."""
    lines: list[dict[str, Any]] = []
    now_s = 0.0
    progress = ProgressLines(lambda text: lines.append({"t": now_s, "text": text}))
    for record in run.records:
        now_s = record.time_s
        try:
            progress(record)
        except (KeyError, TypeError):  # of a version that wrote other keys
            continue
        if record.kind is Kind.END:
            lines.append({"t": now_s, "text": str(record.data.get("ending", "ended")).replace("_", " ")})
    return lines
