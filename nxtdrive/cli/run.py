"""``nxtdrive run``: the main job."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE, LINK_LOST, NOT_ACHIEVED
from nxtdrive.cli.options import add_brick_arguments, add_json_argument

if TYPE_CHECKING:
    from types import FrameType

    from behaviors.executive import Report
    from behaviors.journal import Observer, Record
    from behaviors.mission import Mission
    from behaviors.ports import Eyes
    from nxtdrive.brick import Brick
    from nxtdrive.recording.recording import Recording

DESCRIPTION = """\
Run a mission: search for its targets, drive to them, recover from failures.
Without a file, the built-in mission "lena, then rilakkuma". Ctrl-C stops the
motors and leaves a complete run folder."""
EXAMPLES = """\
  nxtdrive run
  nxtdrive run --nxt "sim://?seed=7"
  nxtdrive run my-mission.toml --nxt usb:// --camera 0
  nxtdrive run --nxt serial:///tmp/nxt --camera http://127.0.0.1:8081/camera.mjpg
  nxtdrive run --json --no-video"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("mission", metavar="MISSION.toml", nargs="?", type=Path, help="default: the built-in mission")
    add_brick_arguments(parser)
    parser.add_argument(
        "--camera",
        metavar="SOURCE",
        help="a webcam's number, a video, a folder of images, an MJPEG or RTSP URL, or 'sim' "
        "(default: the simulated robot's for sim://, else webcam 0)",
    )
    parser.add_argument(
        "--out", metavar="FOLDER", type=Path, default=Path("runs"), help="where the run's folder goes (default: runs)"
    )
    parser.add_argument("--no-video", action="store_true", help="do not record camera.mp4")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Run the mission; returns the exit code."""
    from behaviors.console import Console
    from nxtdrive import mission_run
    from nxtdrive.brick import open_brick
    from nxtdrive.recording.recording import Recording
    from nxtdrive.recording.run_folder import new_run_folder
    from nxtdrive.recording.status_line import StatusLine
    from nxtdrive.recording.video import VIDEO_FPS

    mission = mission_run.load(args.mission)
    console = Console(lambda line: print(line, flush=True))
    if not args.json:
        console.say("Connecting to NXT")
    with ExitStack() as stack:
        stack.enter_context(_terminating_gracefully())
        brick = stack.enter_context(open_brick(args.nxt))
        source = args.camera or mission_run.default_camera(brick)
        camera = stack.enter_context(closing(mission_run.open_mission_camera(source, brick)))
        eyes = mission_run.camera_eyes(camera, mission)
        recording = Recording(new_run_folder(args.out, mission.mission.name), video=not args.no_video)
        eyes.on_look(recording.look)
        mission_run.watch(camera, brick, recording.frame, VIDEO_FPS)
        status = stack.enter_context(StatusLine())
        observers: list[Observer] = [_print_json] if args.json else [console, status]
        details: dict[str, object] = {"mission": mission.mission.name, "nxt": args.nxt, "camera": source}
        report = _pursue(mission, brick, eyes, recording, observers, details)
    _say_where(report, recording, details, as_json=args.json)
    return _exit_code(report)


def _pursue(
    mission: Mission,
    brick: Brick,
    eyes: Eyes,
    recording: Recording,
    observers: Sequence[Observer],
    details: dict[str, object],
) -> Report:
    """Run the mission; the folder is complete afterwards, whatever happens."""
    from behaviors.executive import Executive
    from nxtdrive.mission_run import build_rover

    report, error = None, ""
    try:
        executive = Executive(mission, build_rover(brick, mission), eyes, brick, [recording, *observers])
        report = executive.run()
        return report
    except BaseException as reason:
        error = str(reason) or type(reason).__name__
        raise
    finally:
        recording.finish(report, error, details)


def _print_json(record: Record) -> None:
    print(record.to_json(), flush=True)


def _say_where(report: Report, recording: Recording, details: dict[str, object], *, as_json: bool) -> None:
    """The end of the output: what became of the targets, and where the files are."""
    from nxtdrive.recording.run_folder import summary

    folder = recording.folder.path
    if as_json:
        print(
            json.dumps({"kind": "summary", **summary(report, "", details), "folder": str(folder)}, ensure_ascii=False)
        )
        return
    print(f"{report.ending.replace('_', ' ')} after {report.duration_s:.1f} s")
    for errand in report.errands:
        when = "" if errand.time_s is None else f" at {errand.time_s:.1f} s"
        print(f"  {errand.target}: {errand.fate.replace('_', ' ')}{when}, searches: {errand.attempts}")
    if report.error:
        print(f"nxtdrive: {report.error}", file=sys.stderr)
    for path in recording.files():
        print(path)


def _exit_code(report: Report) -> int:
    from behaviors.executive import Ending

    if report.ending is Ending.LINK_LOST:
        return LINK_LOST
    return DONE if report.achieved else NOT_ACHIEVED


@contextmanager
def _terminating_gracefully() -> Iterator[None]:
    """SIGTERM ends a run as Ctrl-C does: motors stopped, folder complete."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
