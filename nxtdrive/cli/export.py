"""``nxtdrive export``: a run as files for other programs and other people."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import writing
from nxtdrive.cli.output import write_line
from nxtdrive.cli.progress import with_progress

if TYPE_CHECKING:
    from nxtdrive.recording.camera_index import CameraPictures
    from nxtdrive.recording.run_reader import PastRun

DESCRIPTION = """\
Make files of a run for other programs and other people: a video of its camera."""
EXAMPLES = """\
  nxtdrive export runs/lena-then-rilakkuma-001 --webm"""
IN_FOLDER = Path()
"""Stands for a file in the run's folder."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("run_path", metavar="RUN", type=Path, help="a run's folder")
    parser.add_argument(
        "--webm",
        metavar="FILE",
        nargs="?",
        type=Path,
        const=IN_FOLDER,
        help="the camera's pictures as a video with boxes, state and time (default: camera.webm in the run's folder)",
    )


def run(args: argparse.Namespace) -> int:
    """Write what is wanted; returns the exit code."""
    from nxtdrive.recording.camera_index import read_pictures
    from nxtdrive.recording.run_reader import read_run

    if args.webm is None:
        raise ConfigError("export what of the run?", remedy="Give --webm.")
    past = read_run(args.run_path)
    pictures = read_pictures(past.path.parent)
    if args.webm is not None:
        _write_webm(past, pictures, args.webm)
    return DONE


def _write_webm(past: PastRun, pictures: CameraPictures | None, file: Path) -> None:
    from nxtdrive.recording.run_folder import VIDEO
    from nxtdrive.recording.video import write_webm

    if pictures is None:
        raise ConfigError(
            f"{past.path.parent} has no pictures of the camera.", remedy="Runs without --no-video have them in camera/."
        )
    path = past.path.parent / VIDEO if file == IN_FOLDER else file
    with writing(path):
        write_webm(pictures, past.records, path, with_progress(path.name))
    _say(path)


def _say(path: Path, *details: str) -> None:
    """Print what was written."""
    size = f"{path.stat().st_size / 1e6:.1f} MB"
    write_line(f"{path}: {', '.join([size, *details])}")
