"""``nxtdrive doctor``: finds what is wrong and prints the remedy."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import AddressError, ConfigError, NXTError
from firmware_protocol.wording import number_of
from nxtdrive.cli.main import DONE, NO_BRICK, NOT_ACHIEVED
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, add_robot_argument
from nxtdrive.cli.output import write_json, write_text
from nxtdrive.cli.prompt import agrees, can_ask

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from nxtdrive.brick import Brick
    from nxtdrive.tools.doctor.finding import Finding
    from nxtdrive.transports.address import Address

DESCRIPTION = """\
Examine this computer and the brick: libraries, permissions, pairing, ports,
camera, firmware, battery, sleep timer; with --wiggle also motors and sensors.
Each line is ok, a warning, or a problem with its remedy. Without --nxt and $NXT
the brick on USB is examined. Exit code: 0 no problem, 1 problems, 3 no
brick to examine."""
EXAMPLES = """\
  nxtdrive doctor
  nxtdrive doctor --nxt sim:// --wiggle --yes
  nxtdrive doctor --nxt serial:///dev/rfcomm0 --json
  nxtdrive doctor --fix-udev
  nxtdrive doctor --fix-udev --install"""

BRICK = "brick"
"""Topic of findings about the brick as a whole."""
MOTOR_QUESTION = "Motors will turn a little. Lift the robot or clear the floor. Continue?"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_brick_arguments(parser, default="usb://")
    parser.add_argument("--wiggle", action="store_true", help="turn each motor a little and query the sensors")
    parser.add_argument("--yes", action="store_true", help="do not ask before motors turn")
    parser.add_argument(
        "--mission", metavar="FILE", type=Path, help="how the robot is built, for --wiggle (default: built-in)"
    )
    add_robot_argument(parser)
    parser.add_argument("--camera", metavar="SOURCE", help="which camera to try (default: as for `nxtdrive run`)")
    parser.add_argument(
        "--fix-udev", action="store_true", help="print the udev rule for the brick and how to install it"
    )
    parser.add_argument("--install", action="store_true", help="with --fix-udev: install the rule; needs root")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Examine and report."""
    if args.install and not args.fix_udev:
        raise ConfigError("--install belongs to --fix-udev.", remedy="Give both.")
    if args.fix_udev:
        return _fix_udev(install=args.install)
    mission = None
    if args.mission is not None or args.wiggle:  # report a missing or wrong file before the examination
        from nxtdrive.mission.files import read_mission_file

        mission = read_mission_file(args.mission, args.robot)
    examination = _Examination(args, mission)
    findings: list[Finding] = []
    for finding in examination.findings():
        if finding.topic == BRICK and any(finding.text == known.text for known in findings):
            continue  # opening the brick finds missing parts a second time
        findings.append(finding)
        if not args.json:
            _print(finding)
    problems = sum(finding.verdict == "problem" for finding in findings)
    if args.json:
        report = {"findings": [asdict(finding) for finding in findings], "problems": problems}
        write_json({**report, "brick": examination.reached}, indent=2)
    else:
        unreached = "" if examination.reached else " No brick could be examined."
        write_text(f"\n{number_of(problems, 'problem') if problems else 'No problems'} found.{unreached}")
    if not examination.reached:
        return NO_BRICK
    return NOT_ACHIEVED if problems else DONE


class _Examination:
    """Examines computer and brick, in order.

    Attributes:
        reached: Whether a brick could be opened.
    """

    def __init__(self, args: argparse.Namespace, mission: Mission | None) -> None:
        self.reached = False
        self._args = args
        self._mission = mission

    def findings(self) -> Iterator[Finding]:
        """Yield each finding as it is made."""
        from nxtdrive.tools.doctor import computer
        from nxtdrive.transports.address import Address
        from nxtdrive.transports.record import brick_address

        args = self._args
        address = Address.parse(args.nxt)
        scheme = brick_address(address).scheme
        simulated = scheme == "sim"
        yield from computer.examine(scheme, args.camera or (None if simulated else "0"))
        yield _calibration(args, self._mission)
        yield from self._brick(address, own_camera=simulated and not args.camera)

    def _brick(self, address: Address, *, own_camera: bool) -> Iterator[Finding]:
        from nxtdrive.brick import open_brick
        from nxtdrive.tools.doctor.finding import problem

        try:
            with open_brick(address) as brick:
                self.reached = True
                yield from self._opened(brick, own_camera=own_camera)
        except (AddressError, ConfigError):
            raise
        except NXTError as error:
            yield problem(BRICK, error.args[0], error.remedy or "Switch the brick off and on again.")

    def _opened(self, brick: Brick, *, own_camera: bool) -> Iterator[Finding]:
        from nxtdrive.tools.doctor import brick as brick_checks

        if own_camera:
            yield _simulated_camera(brick)
        yield from brick_checks.examine(brick)
        yield from _other_brick(brick, _robot_file(self._args, self._mission))
        if self._args.wiggle and self._mission is not None:
            yield from _wiggle(brick, self._mission, agreed=self._args.yes)


def _robot_file(args: argparse.Namespace, mission: Mission | None) -> Path | None:
    """Return the robot file that missions use."""
    from behaviors.mission import chosen_robot_file
    from nxtdrive.mission.files import default_robot_file

    named = None if mission is None else mission.mission.robot_file
    return chosen_robot_file(named, args.mission, args.robot, default_robot_file())


def _other_brick(brick: Brick, robot_file: Path | None) -> Iterator[Finding]:
    """Warn of a robot file that describes another brick."""
    from behaviors.mission.robot import RobotFileError, brick_id, load_robot_file
    from nxtdrive.tools.doctor.finding import warning

    if robot_file is None:
        return
    with suppress(RobotFileError):  # reported before the brick was opened
        described = load_robot_file(robot_file).calibration
        address = brick.info().bluetooth_address
        if described.describes_another(address):
            said = f"{robot_file} describes the brick {described.brick_id}, and this one is {brick_id(address)}."
            yield warning("robot file", said, "Name this robot's file with --robot, or measure this robot.")


def _calibration(args: argparse.Namespace, mission: Mission | None) -> Finding:
    """Return which values the robot file that missions use has calibrated."""
    from behaviors.mission.robot import RobotFileError, load_robot_file
    from nxtdrive.mission.files import ROBOT_FILE
    from nxtdrive.tools.doctor.finding import ok, problem, warning
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.record import brick_address

    path = _robot_file(args, mission)
    brick = brick_address(Address.parse(args.nxt))
    words = [] if brick.scheme == "sim" else ["--nxt", str(brick), "--camera", args.camera or "0"]
    if path and path != Path(ROBOT_FILE):
        words += ["--robot", str(path)]
    options = "".join(f" {shlex.quote(word)}" for word in words)
    if path is None and os.path.lexists(ROBOT_FILE):
        said = f"{ROBOT_FILE} is in this folder, but missions do not use it."
        return warning("calibration", said, f"Add --robot {ROBOT_FILE} to commands, or set NXT_ROBOT={ROBOT_FILE}.")
    if path is None:
        said = "there is no robot file; the default values are used."
        return warning("calibration", said, f"Measure the robot: nxtdrive calibrate{options}")
    try:
        calibration = load_robot_file(path).calibration
    except RobotFileError as error:
        return problem("calibration", str(error), f"Correct it, or create it again: nxtdrive calibrate{options}")
    said = f"{path}: {calibration.summary}"
    if missing := calibration.missing:
        return warning("calibration", said, f"Measure the rest: nxtdrive calibrate {' '.join(missing)}{options}")
    return ok("calibration", said)


def _simulated_camera(brick: Brick) -> Finding:
    from contextlib import closing

    from nxtdrive.mission.camera import SIMULATED, open_mission_camera
    from nxtdrive.tools.doctor.finding import ok

    with closing(open_mission_camera(SIMULATED, brick)) as camera:
        height, width = camera.read(1.0).image.shape[:2]
    return ok("camera", f"the simulated camera delivers frames of {width}x{height}")


def _wiggle(brick: Brick, mission: Mission, *, agreed: bool) -> Iterator[Finding]:
    from nxtdrive.tools.doctor import brick as brick_checks
    from nxtdrive.tools.doctor.finding import warning

    if program := brick.programs.running:
        yield warning("wiggle", f"skipped: {program} is running on the brick.", "Stop it: nxtdrive program stop")
        return
    if not agreed and not (can_ask() and agrees(MOTOR_QUESTION)):
        yield warning("wiggle", "skipped: motors may not turn.", "Lift the robot, then run it with --wiggle --yes.")
        return
    yield from brick_checks.wiggle(brick, mission)


def _fix_udev(*, install: bool) -> int:
    from nxtdrive.host.access import UDEV_FILE
    from nxtdrive.tools.doctor import udev

    if not install:
        write_text(udev.instructions())
        return DONE
    if not sys.platform.startswith("linux"):
        raise ConfigError("only Linux has udev.", remedy="Other systems need no rule.")
    if os.geteuid() != 0:
        raise ConfigError(
            "writing the rule needs root.", remedy=f"Run: sudo {_own_command()} doctor --fix-udev --install"
        )
    try:
        write_text(udev.install(Path(UDEV_FILE), udev.UDEV_COMMANDS, os.environ.get("SUDO_USER", "")))
    except OSError as error:
        raise ConfigError(
            f"the rule could not be installed: {UDEV_FILE}: {error.strerror or error}.",
            remedy="See `nxtdrive doctor --fix-udev`.",
        ) from None
    return DONE


def _own_command() -> str:
    """Return a command for this program that works in root's shell, whose PATH lacks virtual environments."""
    program = shutil.which("nxtdrive")
    return shlex.join([program] if program else [sys.executable, "-m", "nxtdrive"])


def _print(finding: Finding) -> None:
    from nxtdrive.tools.doctor.finding import lines

    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    write_text("\n".join(lines(finding, width)), flush=True)
