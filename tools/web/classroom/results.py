"""The results of a classroom, as a table, as CSV, and all runs as one ZIP file."""

from __future__ import annotations

import zipfile
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from nxtdrive.recording.csv_table import csv_text

from ..runs import Runs
from .config import ClassroomConfig
from .station import result

COLUMNS = ("robot", "run", "mission", "ending", "achieved", "reached", "targets", "seconds")


def results(config: ClassroomConfig) -> list[dict[str, Any]]:
    """Return robot, run and result of each run, robot by robot, the newest first."""
    return [
        {"robot": robot.name, "run": run["name"], **result(run)}
        for robot in config.robots
        for run in Runs(config.runs / robot.name).listed()
    ]


def results_csv(rows: list[dict[str, Any]]) -> str:
    """Return results as CSV."""
    return csv_text(COLUMNS, rows)


def write_zip(config: ClassroomConfig, file: IO[bytes]) -> None:
    """Write the runs of all robots as a ZIP file: ``runs/ROBOT/RUN/...``.

    Files that vanish in the meantime are left out, and so are targets of symbolic links.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as archive:
        for robot in config.robots:
            folder = config.runs / robot.name
            for path in sorted(folder.rglob("*")):
                _add(archive, path, Path("runs", robot.name, path.relative_to(folder)))


def _add(archive: zipfile.ZipFile, path: Path, name: Path) -> None:
    if path.is_file() and not path.is_symlink():
        with suppress(FileNotFoundError):
            archive.write(path, str(name).encode(errors="replace").decode())  # a ZIP file's names are UTF-8
