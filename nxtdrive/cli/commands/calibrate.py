"""``nxtdrive calibrate``: measures how the robot is built."""

from __future__ import annotations

import argparse
import datetime
import math
import os
import shlex
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, NOT_ACHIEVED
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, number, output_file, write_output
from nxtdrive.cli.output import make_console, make_table, print_line, write_error, write_json, write_line
from nxtdrive.cli.prompt import agrees, can_ask
from nxtdrive.host.writing import writing
from nxtdrive.tools.calibrate import SHEET_HEIGHT_MM

if TYPE_CHECKING:
    from behaviors.mission.robot import RobotFile
    from nxtdrive.tools.calibrate.session import CalibrationResult
    from nxtdrive.transports.address import Address

DESCRIPTION = """\
Measure how the robot is built, and write it to a robot file: the camera's field
of view, position, angles and latency; the wheels' diameter, mismatch and track;
the sonar's position; the motors' directions; how a colour looks. The robot drives
in front of a sheet of markers: print it with --sheet, hang it on a wall with its
middle as high as the lens, and put the robot one metre in front of it, with a
metre of free floor all around. With sim://, the default, it does so in the
simulated room sim://calibration, with --ruler in sim://empty, and learns colours
in sim://colors. Values that are too uncertain are refused, and the file stays as
it was."""
EXAMPLES = """\
  nxtdrive calibrate --sheet sheet.pdf
  nxtdrive calibrate
  nxtdrive calibrate --nxt usb:// --camera 0 --robot my-robot.toml
  nxtdrive calibrate camera wheels --nxt usb:// --camera 0
  nxtdrive calibrate wheels --ruler --nxt usb://
  nxtdrive calibrate colors --color red --nxt usb:// --camera 0"""

ALL = "all"
COLORS = "colors"
CHOICES = ("camera", "wheels", "sonar", "motors", ALL, COLORS)
SHEET_ROOM, COLORS_ROOM, RULER_ROOM = "calibration", "colors", "empty"
"""Rooms of sim://: one with a sheet, one for colours, and one where the robot can drive a metre ahead."""
SPACE_BYTES = 16_000
"""Free space that is required: a robot file and the copy of the previous one take some kilobytes."""
BEFORE_THE_SHEET = (
    "The robot will drive up to 0.8 m towards the sheet, and back, and turn full circles. "
    "Is it one metre in front of the sheet, with free floor all around?"
)
BY_RULER = "The robot will drive one metre ahead and turn on the spot. Is the floor ahead free?"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "what", metavar="WHAT", nargs="*", help=f"what to calibrate: {', '.join(CHOICES)} (default: {ALL})"
    )
    add_brick_arguments(parser)
    parser.add_argument("--camera", metavar="SOURCE", help="as for `nxtdrive run`")
    parser.add_argument(
        "--robot",
        metavar="FILE",
        type=output_file,
        help="the robot file to write; if it exists, its other values are kept (default: $NXT_ROBOT, else robot.toml)",
    )
    parser.add_argument(
        "--sheet", metavar="FILE", type=Path, help="write the sheet of markers, *.pdf or *.png, and end"
    )
    parser.add_argument(
        "--sheet-height-mm",
        metavar="MM",
        type=number("height", float, 20, 2000),
        default=SHEET_HEIGHT_MM,
        help=f"the middle of the sheet above the floor (default: {SHEET_HEIGHT_MM:g})",
    )
    parser.add_argument(
        "--ruler",
        action="store_true",
        help="with `wheels`: measure a straight drive and turns yourself, without a camera",
    )
    parser.add_argument(
        "--color",
        metavar="NAME",
        help="with `colors`: the colour of the object in the middle of the picture (default: what it resembles most)",
    )
    parser.add_argument("--yes", action="store_true", help="do not ask before the robot drives")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Calibrate and return the exit code."""
    what = _wanted(args)
    if args.sheet:
        return _write_sheet(args.sheet)
    from nxtdrive.mission.files import ROBOT_FILE, default_robot_file, read_robot_file
    from nxtdrive.tools.calibrate.course import CalibrationRefused
    from nxtdrive.tools.calibrate.verdict import write_robot_file
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.record import brick_address, in_room

    path = args.robot or default_robot_file() or ROBOT_FILE
    before = read_robot_file(path if os.path.lexists(path) else None)
    with writing(path), tempfile.TemporaryFile(dir=path.parent) as trial:
        trial.write(bytes(SPACE_BYTES))  # refused before the robot drives for minutes, if nothing can be written there
    colors = what == [COLORS]
    room = COLORS_ROOM if colors else RULER_ROOM if args.ruler else SHEET_ROOM
    address = in_room(Address.parse(args.nxt), room)
    if not (brick_address(address).scheme == "sim" or args.yes or colors):
        _ask(BY_RULER if args.ruler else BEFORE_THE_SHEET)
    try:
        if args.ruler:
            outcome = _by_ruler(address, before)
        elif colors:
            outcome = _colors(args, address, before)
        else:
            outcome = _before_the_sheet(args, address, before, what)
    except CalibrationRefused as refusal:
        write_error(f"{refusal} {path} was {'left as it is' if os.path.lexists(path) else 'not written'}.")
        return NOT_ACHIEVED
    _report(outcome, path, as_json=args.json)  # first, so that nothing is lost if it cannot be written
    with writing(path):
        copy = write_robot_file(path, outcome.file)
    if not args.json:
        file = shlex.quote(str(path))
        write_line(
            f"Written to {path}. Missions use it with --robot {file}, or with NXT_ROBOT={file} in the environment."
        )
        if copy is not None:
            write_line(f"The file as it was before is {copy}; copy it to {path} to undo this.")
    return DONE


def _wanted(args: argparse.Namespace) -> list[str]:
    """Return the names of what to calibrate, in order."""
    from behaviors.mission.robot import CALIBRATED

    for each in args.what:
        if each not in CHOICES:
            raise ConfigError(f"there is no {each!r} to calibrate.", remedy=f"Known: {', '.join(CHOICES)}.")
    if args.ruler and args.what != ["wheels"]:
        raise ConfigError("--ruler is for the wheels alone.", remedy="Write: nxtdrive calibrate wheels --ruler.")
    if (args.color or COLORS in args.what) and args.what != [COLORS]:
        raise ConfigError("colours are calibrated alone.", remedy="Write: nxtdrive calibrate colors --color NAME.")
    if COLORS in args.what:
        return [COLORS]
    wanted = args.what or [ALL]
    return [each for each in CALIBRATED if each in wanted or ALL in wanted]


def _before_the_sheet(
    args: argparse.Namespace, address: Address, before: RobotFile, what: list[str]
) -> CalibrationResult:
    from nxtdrive.mission.assembly import open_robot
    from nxtdrive.tools.calibrate.session import calibrate

    say: Callable[[str], None] = (lambda _: None) if args.json else print_line
    with open_robot(address, args.camera) as robot:
        return calibrate(robot.brick, robot.camera, before, what, _today(), say, args.sheet_height_mm)


def _colors(args: argparse.Namespace, address: Address, before: RobotFile) -> CalibrationResult:
    from nxtdrive.mission.assembly import open_robot
    from nxtdrive.tools.calibrate.colors import calibrate_color
    from nxtdrive.vision.detectors.color import default_shade

    if args.color:
        default_shade(args.color)  # before a brick is opened
    with open_robot(address, args.camera) as robot:
        return calibrate_color(robot.brick, robot.camera, before, _today(), args.color)


def _by_ruler(address: Address, before: RobotFile) -> CalibrationResult:
    from nxtdrive.brick import open_brick
    from nxtdrive.tools.calibrate.ruler import calibrate_by_ruler

    with open_brick(address) as brick:
        return calibrate_by_ruler(brick, before, _today(), _await_enter, _ask_number)


def _today() -> datetime.date:
    return datetime.datetime.now().astimezone().date()


def _await_enter(instruction: str) -> None:
    _read_line(f"{instruction} Press Enter.")


def _ask_number(question: str) -> float:
    """Ask for a number until there is one; Enter alone is 0."""
    while True:
        answer = _read_line(question).strip() or "0"
        with suppress(ValueError):
            if math.isfinite(value := float(answer)):
                return value
        write_error(f"{answer!r} is not a number. Write one such as 985 or -12.5; Enter alone means 0.", sender="")


def _read_line(prompt: str) -> str:
    sys.stderr.write(f"{prompt} ")
    sys.stderr.flush()
    try:
        return input()
    except EOFError:
        raise ConfigError(
            "the input ended before all questions were answered.", remedy="Run it in a terminal, and answer each."
        ) from None


def _write_sheet(path: Path) -> int:
    from nxtdrive.tools.calibrate.sheet import sheet_bytes

    content = sheet_bytes(path.suffix)
    write_output(path, content)
    write_line(f"{path}: print it at 100 %; the line below the markers must be 100 mm long.")
    return DONE


def _ask(question: str) -> None:
    if not can_ask():
        raise ConfigError("the robot drives, and there is no terminal to ask in.", remedy="Add --yes.")
    if not agrees(question):
        raise ConfigError("you did not agree that the robot may drive.", remedy="Clear the floor, then answer y.")


def _report(outcome: CalibrationResult, path: Path, *, as_json: bool) -> None:
    if as_json:
        values = {line.key: line.after for line in outcome.lines}
        errors = {line.key: line.standard_error for line in outcome.lines if line.standard_error is not None}
        known = {"file": str(path), "values": values, "standard_errors": errors, "views": outcome.views}
        write_json({**known, "misfit_px": outcome.misfit_px, "remark": outcome.remark}, indent=2)
        return
    table = make_table("", "before", "measured", "uncertain by")
    for line in outcome.lines:
        unsure = "" if line.standard_error is None else f"{line.standard_error:.2g}"
        table.add_row(line.key, _short(line.before), _short(line.after), unsure)
    make_console().print(table)
    if outcome.remark:
        write_line(outcome.remark)
    if outcome.misfit_px:
        before_px, after_px = outcome.misfit_px
        frames = f"({outcome.views} frames)"
        write_line(f"Markers were missed by {before_px:.1f} px before, and by {after_px:.1f} px now {frames}.")


def _short(value: object) -> str:
    if value is None:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value).lower()
