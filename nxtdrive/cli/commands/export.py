"""``nxtdrive export``: writes a run as files for other programs and other people."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import number_of
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import check_not_read, number, write_output
from nxtdrive.cli.output import write_content, write_error, write_line
from nxtdrive.cli.progress import with_progress
from nxtdrive.host.writing import writing

if TYPE_CHECKING:
    from nxtdrive.recording.camera_index import RecordedFrames
    from nxtdrive.recording.run_reader import PastRun

DESCRIPTION = """\
Export a run to files for other programs and other people: its replay as one HTML
file that any browser opens without nxtdrive, messages (MCAP) for programs such as
Lichtblick and Foxglove, a table (CSV) for spreadsheets and data frames, and a
video of its camera. The file `-` is standard output."""
EXAMPLES = """\
  nxtdrive export runs/lena-then-rilakkuma-001 --html
  nxtdrive export runs/lena-then-rilakkuma-001 --html lena.html --fps 2
  nxtdrive export runs/lena-then-rilakkuma-001 --mcap lena.mcap --webm
  nxtdrive export runs/lena-then-rilakkuma-001 --csv
  nxtdrive export runs/lena-then-rilakkuma-001 --csv -"""
MAX_PAGE_BYTES = 40_000_000
"""All pictures of a page; without --fps a page has as many pictures per second as fit."""
IN_FOLDER = ""
"""Stands for the default file in the run folder."""
STANDARD_OUTPUT = "-"
BINARY = ("mcap", "webm")
"""Formats that no terminal can show."""
FILES = {"html": "replay.html", "mcap": "run.mcap", "csv": "journal.csv", "webm": "camera.webm"}
"""Default files of the formats; that of the video is the run's own."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("run_path", metavar="RUN", type=Path, help="a run folder")
    for kind, what in (
        ("html", "the replay in one file, with its pictures"),
        ("mcap", "everything as messages for Lichtblick, Foxglove and the like"),
        ("csv", "the journal as a table, one row per record"),
        ("webm", "the camera's pictures as a video with boxes, state and time"),
    ):
        parser.add_argument(
            f"--{kind}",
            metavar="FILE",
            nargs="?",
            const=IN_FOLDER,
            help=f"{what} (default: {FILES[kind]} in the run folder)",
        )
    parser.add_argument(
        "--fps",
        metavar="NUMBER",
        type=number("pictures", float, 0.01, 1000),
        help="pictures per second in the replay (default: all, or as many as fit into 40 MB)",
    )
    parser.add_argument("--no-camera", action="store_true", help="leave the camera out of the replay and the MCAP file")


def run(args: argparse.Namespace) -> int:
    """Write the requested files and return the exit code."""
    from nxtdrive.recording.camera_index import read_frames
    from nxtdrive.recording.run_reader import read_run

    given: dict[str, str] = {kind: file for kind in FILES if (file := getattr(args, kind)) is not None}
    if not given:
        raise ConfigError("no format given.", remedy="Give --html, --mcap, --csv or --webm, or several of them.")
    past = read_run(args.run_path)
    recorded = read_frames(past.path.parent)
    shown = None if args.no_camera else recorded
    writers: dict[str, Callable[[Path], str]] = {
        "html": partial(_write_html, past, shown, args.fps),
        "mcap": partial(_write_mcap, past, shown),
        "csv": partial(_write_csv, past),
        "webm": partial(_write_webm, past, recorded),
    }
    say = write_line if STANDARD_OUTPUT not in given.values() else partial(write_error, sender="")
    for kind, path in _files(past, given).items():
        if given[kind] == STANDARD_OUTPUT:
            with TemporaryDirectory() as folder:
                scratch = Path(folder) / FILES[kind]
                writers[kind](scratch)
                write_content(scratch.read_bytes())
        else:
            details = writers[kind](path)
            say(f"{path}: {', '.join(filter(None, [_size(path), details]))}")
    return DONE


def _write_html(past: PastRun, recorded: RecordedFrames | None, fps: float | None, path: Path) -> str:
    """Write the replay; return what there is to say of it."""
    from nxtdrive.tools.web.replay_page import replay_page, thinned

    folder = past.path.resolve().parent
    said = "without pictures"
    if recorded:
        count = len(recorded.frames)
        recorded = thinned(recorded, fps or _fitting_fps(recorded))
        said = f"{len(recorded.frames)} of {count} pictures"
    write_output(path, replay_page(folder.name, past, recorded).encode())
    return said


def _fitting_fps(recorded: RecordedFrames) -> float:
    """Return how many pictures per second make at most `MAX_PAGE_BYTES`."""
    size = sum(path.stat().st_size for each in recorded.frames if (path := recorded.folder / each.file).is_file())
    return recorded.header.fps * min(1.0, MAX_PAGE_BYTES / max(size, 1))


def _write_mcap(past: PastRun, recorded: RecordedFrames | None, path: Path) -> str:
    from nxtdrive.recording.mcap_file import write_mcap

    with writing(path):
        count = write_mcap(past, recorded, path)
    return number_of(count, "message")


def _write_csv(past: PastRun, path: Path) -> str:
    from nxtdrive.recording.journal_csv import journal_csv

    write_output(path, journal_csv(past.records).encode(errors="replace"))
    return number_of(len(past.records), "row")


def _write_webm(past: PastRun, recorded: RecordedFrames | None, path: Path) -> str:
    from nxtdrive.recording.video import write_webm

    if recorded is None:
        raise ConfigError(
            f"{past.path.parent} has no pictures of the camera.", remedy="Runs without --no-video have them in camera/."
        )
    with writing(path):
        write_webm(recorded, past.records, path, with_progress(path.name))
    return ""


def _files(past: PastRun, given: Mapping[str, str]) -> dict[str, Path]:
    """Return the file to write for each format: as given, or the default one in the run folder.

    Raises:
        ConfigError: One is of those that make the run, is given for two formats, or is a terminal that cannot show it.
    """
    from nxtdrive.recording.run_folder import CAMERA, MAP, MISSION, SUMMARY, WHAT_IF

    folder = past.path.parent
    for kind in BINARY:
        if given.get(kind) == STANDARD_OUTPUT and sys.stdout and sys.stdout.isatty():
            command = f"nxtdrive export {shlex.quote(str(folder))} --{kind} - > FILE"
            raise ConfigError("a terminal cannot show this format.", remedy=f"Redirect it: `{command}`.")
    files = {kind: folder / FILES[kind] if file == IN_FOLDER else Path(file) for kind, file in given.items()}
    if len({os.path.realpath(path) for path in files.values()}) < len(files):
        raise ConfigError("two formats have the same file.", remedy="Give each a file of its own.")
    recorded = [past.path, *(folder / name for name in (MISSION, SUMMARY, MAP, WHAT_IF)), *(folder / CAMERA).glob("*")]
    for path in files.values():
        check_not_read(path, *recorded, option="file")
    return files


def _size(path: Path) -> str:
    count = path.stat().st_size
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"
