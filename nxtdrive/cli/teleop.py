"""``nxtdrive teleop``: drives the robot by hand in a terminal."""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, number
from nxtdrive.cli.pace import in_real_time
from nxtdrive.signals import until_signal

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from nxtdrive.brick import Brick
    from nxtdrive.tools.teleop.gamepad import Gamepad
    from nxtdrive.tools.teleop.spotter import Spotter

DESCRIPTION = """\
Drive by hand: arrow keys or WASD, Q and E for bends, + and - for the speed, space
for an emergency stop, Esc to quit. The robot stops after half a second without a
key, and when the link is lost: the brick itself ends every motion that is not
renewed. The map is drawn from odometry and sonar. A gamepad works, too: the left
stick drives, the right stick steers, B is the emergency stop, A releases it, the
shoulder buttons change the speed. Needs the extra nxtdrive[tui], and for a gamepad nxtdrive[gamepad]."""
EXAMPLES = """\
  nxtdrive teleop
  nxtdrive teleop --nxt usb:// --speed 150
  nxtdrive teleop --gamepad
  nxtdrive teleop --target lena
  nxtdrive teleop --mission my-mission.toml --camera 0 --nxt usb://"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_brick_arguments(parser)
    parser.add_argument(
        "--mission", metavar="FILE", type=Path, help="how the robot is built and what to look for (default: built-in)"
    )
    parser.add_argument(
        "--target", metavar="NAME", help="look for this target of the mission (default: with --mission, its first)"
    )
    parser.add_argument("--camera", metavar="SOURCE", help="as for `nxtdrive run`; only with a target")
    parser.add_argument(
        "--speed",
        metavar="MM_S",
        type=number("speed", float, 20, 350),
        default=300.0,
        help="highest speed, 20 to 350 (default: 300)",
    )
    parser.add_argument(
        "--gamepad",
        action=argparse.BooleanOptionalAction,
        help="drive with a gamepad, too (default: if nxtdrive[gamepad] is installed)",
    )


def run(args: argparse.Namespace) -> int:
    """Drive until the user quits."""
    _check()
    from nxtdrive.brick import open_brick
    from nxtdrive.mission.setup import build_rover, load
    from nxtdrive.tools.teleop.app import Teleop
    from nxtdrive.tools.teleop.controls import Controls
    from nxtdrive.tools.teleop.pilot import Pilot

    mission = load(args.mission)
    target = _target(args, mission)
    with ExitStack() as stack:
        gamepad = _gamepad(args.gamepad, stack)
        brick = stack.enter_context(open_brick(in_real_time(args.nxt)))
        rover = build_rover(brick, mission)
        controls = Controls(args.speed, rover.settings.turn_deg_s)
        spotter = stack.enter_context(closing(_spotter(args, brick, mission, target, stack))) if target else None
        stopped = stack.enter_context(until_signal())
        address = brick.link.transport.address
        app = Teleop(Pilot(brick, rover, controls, spotter), controls, brick.now, address, gamepad, stopped)
        stack.callback(app.finish)
        app.run()
    if app.failure is not None:
        raise app.failure
    return DONE


def _check() -> None:
    """Check what can be checked before the program takes over the screen."""
    from importlib.util import find_spec

    from nxtdrive.host.environment import install_extra

    if find_spec("textual") is None:
        raise ConfigError(
            "teleop draws with textual, which is not installed.",
            remedy=f"Install it: {install_extra('tui')}",
        )
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise ConfigError("teleop needs a terminal to draw on and to read keys from.", remedy="Run it in one.")


def _gamepad(wanted: bool | None, stack: ExitStack) -> Gamepad | None:
    """Return a gamepad, connected or not; None if it is not wanted, or is optional and pygame is missing."""
    from nxtdrive.tools.teleop.gamepad import Gamepad

    if wanted is False:
        return None
    try:
        return stack.enter_context(closing(Gamepad()))
    except ConfigError:
        if wanted:
            raise
        return None


def _target(args: argparse.Namespace, mission: Mission) -> str | None:
    if args.target is None:
        return mission.mission.targets[0] if args.mission else None
    if args.target not in mission.mission.targets:
        known = ", ".join(mission.mission.targets)
        raise ConfigError(f"the mission has no target {args.target!r}.", remedy=f"It has: {known}.")
    return str(args.target)


def _spotter(args: argparse.Namespace, brick: Brick, mission: Mission, target: str, stack: ExitStack) -> Spotter:
    from nxtdrive.mission import setup
    from nxtdrive.tools.teleop.spotter import ThreadSpotter, TurnSpotter

    source = args.camera or setup.default_camera(brick)
    camera = stack.enter_context(closing(setup.open_mission_camera(source, brick)))
    eyes = setup.camera_eyes(camera, mission)
    spotter = TurnSpotter if brick.link.transport.simulated else ThreadSpotter
    return spotter(eyes, target)
