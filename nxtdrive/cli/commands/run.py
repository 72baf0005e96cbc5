"""``nxtdrive run``: runs a mission."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Callable
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, INCOMPLETE, LINK_LOST, NOT_ACHIEVED, REFUSED
from nxtdrive.cli.options import (
    add_brick_arguments,
    add_json_argument,
    add_profile_argument,
    add_robot_argument,
    mission_brick,
    warn_of_room,
)
from nxtdrive.cli.output import make_console, print_line, write_error
from nxtdrive.cli.pace import in_real_time
from nxtdrive.cli.page_options import add_port_argument, require_page
from nxtdrive.cli.progress import with_progress
from nxtdrive.cli.prompt import can_ask
from nxtdrive.host.listening import listen
from nxtdrive.signals import held

if TYPE_CHECKING:
    from behaviors.executive import Report
    from behaviors.journal import Record
    from behaviors.mission import Mission
    from behaviors.observers import Observers
    from behaviors.profiles.profile import MakeProfile
    from nxtdrive.mission.assembly import MissionRun
    from nxtdrive.recording.recording import Recording
    from nxtdrive.recording.status_line import StatusLine
    from nxtdrive.tools.web.live_run import LiveRun

DESCRIPTION = """\
Run a mission: search for its targets, drive to them, recover from failures.
Without a file, the built-in mission "lena, then rilakkuma". A simulated robot
stands in the room that `nxtdrive mission new` wrote with the mission, unless
--nxt or $NXT names another. Ctrl-C stops the motors and leaves a complete run
folder. A link or a camera that is lost suspends the mission until it is back,
for reconnect_timeout_s at most. `nxtdrive explain-run` explains afterwards why
the robot did what it did."""
EXAMPLES = """\
  nxtdrive run
  nxtdrive run my-mission.toml        # in its own simulated room
  nxtdrive run --nxt "sim://?seed=7" --profile adaptive
  nxtdrive run --confirm-recovery     # confirm each recovery
  nxtdrive run my-mission.toml --nxt usb:// --camera 0
  nxtdrive run --web --confirm-recovery     # watch, and decide, in the browser
  nxtdrive run --nxt /tmp/nxt --camera http://127.0.0.1:8081/camera.mjpg
  nxtdrive run --json --no-video"""

OUTPUT = "standard output"
GREETINGS = {"progress": "connecting to {}", "thesis": "[client2] Connecting to NXT"}
"""The first line, before there is a mission, by the style of the console."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("mission", metavar="MISSION.toml", nargs="?", type=Path, help="default: the built-in mission")
    add_brick_arguments(parser)
    add_robot_argument(parser)
    parser.add_argument(
        "--camera",
        metavar="SOURCE",
        help="a webcam's number, a video, a folder of images, an MJPEG or RTSP URL, or 'sim' "
        "(default: the simulated robot's for sim://, else webcam 0)",
    )
    parser.add_argument(
        "--out", metavar="FOLDER", type=Path, default=Path("runs"), help="where the run folder goes (default: runs)"
    )
    add_profile_argument(parser, "how the robot behaves (default: the mission's profile)")
    parser.add_argument(
        "--confirm-recovery",
        action="store_true",
        help="after each failure show the candidates and wait for you to confirm or choose one, in a terminal or "
        "on the page of --web",
    )
    parser.add_argument(
        "--console",
        choices=sorted(GREETINGS),
        default="progress",
        help="what to print during the run: 'progress', what the robot does, when and why (default), "
        "or 'thesis', the lines of the thesis's agent, word for word",
    )
    parser.add_argument(
        "--web",
        action="store_true",
        help="show the run live in the browser; a simulated robot then runs in real time, unless its "
        "address names a pace. Needs the extra nxtdrive[web]",
    )
    add_port_argument(parser, "TCP port of --web")
    parser.add_argument(
        "--no-video",
        action="store_true",
        help="keep no pictures of the camera and make no video of them, which takes a few seconds after a run",
    )
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Run the mission and return the exit code."""
    from behaviors.observers import Observers
    from nxtdrive.mission.assembly import MissionRun, open_robot
    from nxtdrive.recording.status_line import StatusLine
    from nxtdrive.transports.record import brick_address

    mission = _mission(args)
    address = mission_brick(args)
    observers = Observers(on_failure=_say_failure)
    if not args.json:
        observers.attempt(OUTPUT, print_line, GREETINGS[args.console].format(brick_address(address)))
    with ExitStack() as stack:
        page = _page(args, mission, stack) if args.web else None
        robot = stack.enter_context(open_robot(in_real_time(address) if page else address, args.camera))
        warn_of_room(robot.brick)
        status = stack.enter_context(StatusLine(make_console(stderr=True)))
        say_hint = (lambda _: None) if args.json else _say_hint  # the summary has the hints
        if page:
            run = page.assemble(robot, observers, say_hint)
        else:
            make_profile = _supervised(mission, status) if args.confirm_recovery else None
            run = MissionRun(mission, robot, observers, file=args.mission, say_hint=say_hint, make_profile=make_profile)
        release = stack.enter_context(held())  # once there is a folder, it will be complete
        recording = run.record(args.out, video=not args.no_video)
        observers.add("signals", lambda _record: release())
        observers.add(OUTPUT, _print_json if args.json else _console(args.console))
        if not args.json:
            observers.add("status line", status)
        report = page.pursue(run, recording.folder.path.name) if page else run.pursue()
    _write_video(run, report, recording)
    if args.json:
        values = {"kind": "summary", **run.summary(), "folder": str(recording.folder.path)}
        observers.attempt(OUTPUT, print_line, json.dumps(values))
    else:
        observers.attempt(OUTPUT, _say_where, report, recording)
    return _exit_code(report, observers)


def _page(args: argparse.Namespace, mission: Mission, stack: ExitStack) -> LiveRun:
    """Return the run's page, and print its address.

    Raises:
        ConfigError: Its port is not available.
    """
    from nxtdrive.tools.web.live_run import LiveRun

    listener = stack.enter_context(closing(listen(args.port)))
    url = "http://{}:{}/".format(*listener.getsockname())
    with suppress(OSError):
        write_error(f"watch the run at {url}", sender="") if args.json else print_line(f"watch the run at {url}")
    return LiveRun(mission, listener, confirm=args.confirm_recovery, file=args.mission, runs=args.out)


def _mission(args: argparse.Namespace) -> Mission:
    """Load the mission and apply the options.

    Raises:
        ConfigError: The file has mistakes, or there is no terminal for questions.
    """
    from nxtdrive.mission.checking import warnings
    from nxtdrive.mission.files import read_mission_file, with_profile

    if args.web:
        require_page()
    elif args.confirm_recovery and not can_ask():
        raise ConfigError("--confirm-recovery needs a terminal to ask you in.", remedy="Run it in one, or add --web.")
    mission = read_mission_file(args.mission, args.robot)
    if args.profile is not None:
        mission = with_profile(mission, args.profile)
    for warning in warnings(mission):
        write_error(f"warning: {warning}")
    return mission


def _console(style: str) -> Callable[[Record], None]:
    from behaviors.thesis.console import Console
    from nxtdrive.recording.progress_lines import ProgressLines

    return Console(print_line) if style == "thesis" else ProgressLines(print_line)


def _supervised(mission: Mission, status: StatusLine) -> MakeProfile:
    from behaviors.profiles.registry import supervised
    from nxtdrive.cli.terminal_operator import TerminalOperator

    return supervised(mission, TerminalOperator(status))


def _say_hint(text: str) -> None:
    print_line(f"hint: {text}")


def _say_failure(name: str, error: str) -> None:
    with suppress(OSError):
        write_error(f"{name} failed and is incomplete or missing; the mission does not need it: {error}")


def _write_video(run: MissionRun, report: Report, recording: Recording) -> None:
    """Make the video, which Ctrl-C ends; not after a mission that was ended by Ctrl-C itself."""
    from behaviors.executive import Ending
    from nxtdrive.recording.run_folder import VIDEO

    if report.ending is Ending.INTERRUPTED:
        return
    try:
        run.write_video(with_progress(VIDEO))
    except KeyboardInterrupt:
        folder = shlex.quote(str(recording.folder.path))
        write_error(f"{VIDEO} is left out; `nxtdrive export {folder} --webm` makes it.")


def _print_json(record: Record) -> None:
    print_line(json.dumps(record.values()))


def _say_where(report: Report, recording: Recording) -> None:
    """Print the result of each target and the paths of the run's files."""
    from nxtdrive.recording.wording import spaced, target_outcome_words

    print_line(f"{spaced(report.ending)} after {report.duration_s:.1f} s")
    for progress in report.targets:
        when = "" if progress.time_s is None else f" at {progress.time_s:.1f} s"
        print_line(
            f"  {progress.target}: {target_outcome_words(progress.outcome)}{when}, searches: {progress.attempts}"
        )
    for hint in report.hints:  # again, for the reader of a long run's last lines
        _say_hint(hint)
    if report.error:
        write_error(report.error)
    for path in recording.files():
        print_line(str(path))


def _exit_code(report: Report, observers: Observers) -> int:
    """Return the exit code: the mission's result, or `INCOMPLETE` for an achieved one with a failed observer."""
    from behaviors.executive import Ending

    if report.refused:
        return REFUSED
    if report.ending in (Ending.LINK_LOST, Ending.CAMERA_LOST, Ending.SENSOR_LOST):
        return LINK_LOST
    if not report.achieved:
        return NOT_ACHIEVED
    return INCOMPLETE if observers.failures else DONE
