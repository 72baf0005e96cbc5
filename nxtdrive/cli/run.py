"""``nxtdrive run``: the main job."""

from __future__ import annotations

import argparse
import json
import sys
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, LINK_LOST, NOT_ACHIEVED
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, add_profile_argument
from nxtdrive.signals import termination_as_interrupt

if TYPE_CHECKING:
    from behaviors.executive import Executive, Report
    from behaviors.journal import Observer, Record
    from behaviors.mission import Mission
    from behaviors.profiles.profile import MakeProfile
    from nxtdrive.brick import Brick
    from nxtdrive.recording.recording import Recording
    from nxtdrive.recording.status_line import StatusLine

DESCRIPTION = """\
Run a mission: search for its targets, drive to them, recover from failures.
Without a file, the built-in mission "lena, then rilakkuma". Ctrl-C stops the
motors and leaves a complete run folder. A lost link suspends the mission until
the brick is back, for link_patience_s at most. `nxtdrive explain-run` tells
afterwards why the robot did what it did."""
EXAMPLES = """\
  nxtdrive run
  nxtdrive run --nxt "sim://?seed=7" --profile adaptive
  nxtdrive run --confirm-recovery        # you have the last word after each failure
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
    add_profile_argument(parser, "how the robot behaves (default: the mission's profile)")
    parser.add_argument(
        "--confirm-recovery",
        action="store_true",
        help="after each failure show what could be done and wait for you to confirm it or choose; in a terminal",
    )
    parser.add_argument("--no-video", action="store_true", help="do not record camera.mp4")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Run the mission; returns the exit code."""
    from behaviors.console import Console
    from behaviors.executive import Executive
    from nxtdrive.brick import open_brick
    from nxtdrive.mission import setup
    from nxtdrive.recording.recording import Recording
    from nxtdrive.recording.run_folder import new_run_folder
    from nxtdrive.recording.status_line import StatusLine
    from nxtdrive.recording.video import VIDEO_FPS

    mission = _mission(args)
    console = Console(lambda line: print(line, flush=True), choices=mission.mission.profile != "thesis")
    if not args.json:
        console.say("Connecting to NXT")
    with ExitStack() as stack:
        stack.enter_context(termination_as_interrupt())
        brick = stack.enter_context(open_brick(args.nxt))
        _outlast_losses(brick)
        source = args.camera or setup.default_camera(brick)
        camera = stack.enter_context(closing(setup.open_mission_camera(source, brick)))
        eyes = setup.camera_eyes(camera, mission)
        recording = Recording(new_run_folder(args.out, mission.mission.name), video=not args.no_video)
        recording.folder.write_mission(mission)
        eyes.on_look(recording.look)
        setup.watch(camera, brick, recording.frame, VIDEO_FPS)
        status = stack.enter_context(StatusLine())
        observers: list[Observer] = [recording, _print_json] if args.json else [recording, console, status]
        make_profile = _supervised(mission, status) if args.confirm_recovery else None
        rover = setup.build_rover(brick, mission)
        executive = Executive(mission, rover, eyes, brick, observers, make_profile)
        details: dict[str, object] = {"mission": mission.mission.name, "nxt": args.nxt, "camera": source}
        report = _pursue(executive, recording, details)
    _say_where(report, recording, details, as_json=args.json)
    return _exit_code(report)


def _outlast_losses(brick: Brick) -> None:
    """Have a lost link opened again; the mission is suspended meanwhile, and it is the mission that is patient.

    Nobody pulls the simulated cable of an address, and looking after it would shift the simulation by milliseconds.
    """
    brick.link.reconnect_timeout_s = 0.0
    brick.link.reconnecting = not brick.link.transport.simulated


def _mission(args: argparse.Namespace) -> Mission:
    """The mission as it shall run.

    Raises:
        ConfigError: The file has mistakes, or nobody can be asked.
    """
    from nxtdrive.mission.setup import load

    if args.confirm_recovery and not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise ConfigError("--confirm-recovery needs a terminal to ask you in.", remedy="Run it in one, or without it.")
    mission = load(args.mission)
    if args.profile is None:
        return mission
    table = mission.mission.model_copy(update={"profile": args.profile})
    return mission.model_copy(update={"mission": table})


def _supervised(mission: Mission, status: StatusLine) -> MakeProfile:
    from behaviors.profiles.registry import supervised
    from nxtdrive.cli.confirm import TerminalOperator

    return supervised(mission, TerminalOperator(status))


def _pursue(executive: Executive, recording: Recording, details: dict[str, object]) -> Report:
    """Run the mission; the folder is complete afterwards, whatever happens."""
    report, error = None, ""
    try:
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
    for progress in report.targets:
        when = "" if progress.time_s is None else f" at {progress.time_s:.1f} s"
        print(f"  {progress.target}: {progress.outcome.replace('_', ' ')}{when}, searches: {progress.attempts}")
    if report.error:
        print(f"nxtdrive: {report.error}", file=sys.stderr)
    for path in recording.files():
        print(path)


def _exit_code(report: Report) -> int:
    from behaviors.executive import Ending

    if report.ending is Ending.LINK_LOST:
        return LINK_LOST
    return DONE if report.achieved else NOT_ACHIEVED
