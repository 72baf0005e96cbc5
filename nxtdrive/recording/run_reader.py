"""Read the folder of a run, even of one that was killed."""

from __future__ import annotations

import os
from codecs import BOM_UTF8
from dataclasses import dataclass
from pathlib import Path

from behaviors.journal import JOURNAL_FORMAT, Record, end_of, start_of
from behaviors.mission import Mission
from behaviors.profile_names import PAST
from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES, parse_object
from input_files.mistakes import nearest
from input_files.plain import InputFileError, read_bytes, read_text
from nxtdrive.recording.run_folder import JOURNAL, MISSION, SUMMARY


@dataclass(frozen=True, slots=True)
class PastRun:
    """A run as its folder has it.

    Attributes:
        path: Its journal.
        records: The journal's records.
        damaged: Numbers of lines that cannot be read, from 1.
        mission: The mission with its parameters; None if the folder has none that this version can read.
        hints: What to check or change, as the run printed it; empty without a summary.
    """

    path: Path
    records: tuple[Record, ...]
    damaged: tuple[int, ...]
    mission: Mission | None
    hints: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The mission's name, or an empty string."""
        begun = start_of(self.records)
        return str(begun.data.get("mission", "")) if begun else ""

    @property
    def format(self) -> int:
        """The format of the journal; 1 where it does not say."""
        begun = start_of(self.records)
        number = begun.data.get("format", 1) if begun else 1
        return number if isinstance(number, int) else 1

    @property
    def end(self) -> Record | None:
        """The record of the mission's end; None if the run was killed or is in progress."""
        return end_of(self.records)


def read_run(path: Path) -> PastRun:
    """Read a run.

    Args:
        path: Its folder, or its journal.

    Raises:
        ConfigError: There is no journal, or nothing in it, or a later version wrote it; or it cannot be read.
    """
    if os.path.isdir(path):
        folder, path = path, path / JOURNAL
        try:
            names = os.listdir(folder)
        except OSError as error:
            remedy = "Change the folder's permissions, or name another run."
            raise ConfigError(f"{folder} cannot be read ({error.strerror}).", remedy=remedy) from None
        if JOURNAL not in names:
            example = next((journal.parent for journal in journals_in(folder)), "runs/my-mission-001")
            raise ConfigError(
                f"{folder} contains no {JOURNAL}.", remedy=f"Name the folder of one run, such as {example}."
            )
    elif not os.path.lexists(path) and (meant := _similar_run(path)):
        raise ConfigError(f"there is no run {path}.", remedy=f"Did you mean {meant}?")
    try:
        lines = read_bytes(path, MAX_BYTES).removeprefix(BOM_UTF8).split(b"\n")
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    records, damaged = _records(lines)
    if not records:
        raise ConfigError(
            f"{path} is not a journal: no line of it is a record.",
            remedy="Name the folder of a run, such as runs/my-mission-001, or its journal.jsonl.",
        )
    folder = path.parent
    run = PastRun(path, tuple(records), tuple(damaged), _mission(folder / MISSION), _hints(folder / SUMMARY))
    if run.format > JOURNAL_FORMAT:
        raise ConfigError(
            f"{path} has format {run.format}, and this version reads formats up to {JOURNAL_FORMAT}.",
            remedy="Install the version of nxtdrive that wrote it, or a later one.",
        )
    return run


def journals_in(folder: Path) -> list[Path]:
    """Return the journals of all runs in a folder, the one written last first."""
    return sorted(folder.glob(f"*/{JOURNAL}"), key=changed_s, reverse=True)


def _similar_run(path: Path) -> Path | None:
    """Return the run that was probably meant: one of a similar name beside the path or in the usual folder."""
    runs = {
        journal.parent.name: journal.parent for each in (Path("runs"), path.parent) for journal in journals_in(each)
    }
    return runs.get(path.name) or runs.get(nearest(path.name, runs))


def changed_s(path: Path) -> float:
    """Return when a file was changed; 0 for one that has been removed."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _records(lines: list[bytes]) -> tuple[list[Record], list[int]]:
    records, damaged = [], []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            records.append(Record.from_json(line.decode()))
        except ValueError:
            damaged.append(number)
    return records, damaged


def _mission(path: Path) -> Mission | None:
    """Read a mission; None if there is none, or if another version wrote it with other keys."""
    try:
        return Mission.model_validate(parse_object(read_text(path, MAX_BYTES)), context=PAST)
    except ValueError:
        return None


def _hints(path: Path) -> tuple[str, ...]:
    """Read the hints of a summary; none if there is no summary, as of a run that was killed."""
    try:
        hints = parse_object(read_text(path, MAX_BYTES)).get("hints")
    except ValueError:
        return ()
    return tuple(each for each in hints if isinstance(each, str)) if isinstance(hints, list) else ()
