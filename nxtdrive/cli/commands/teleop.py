"""``nxtdrive teleop``: drives the robot by hand in a terminal."""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, add_robot_argument, mission_brick, number
from nxtdrive.cli.pace import in_real_time
from nxtdrive.host.environment import require
from nxtdrive.signals import until_signal

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from nxtdrive.brick import Brick
    from nxtdrive.tools.teleop.gamepad import Gamepad
    from nxtdrive.tools.teleop.latest_frame import LatestFrame
    from nxtdrive.tools.teleop.spotter import Spotter
    from nxtdrive.vision.camera import Camera

DESCRIPTION = """\
Drive by hand: arrow keys or WASD, Q and E for bends, + and - for the speed, space
for an emergency stop, Esc to quit. The robot stops after half a second without a
key, and when the link is lost: the brick itself ends every motion that is not
renewed. The map is drawn from odometry and sonar. A gamepad works too: the left
stick drives, the right stick steers, B is the emergency stop, A releases it, the
shoulder buttons change the speed. The camera's picture is shown as well; ? lists
the keys. Needs the extra nxtdrive[tui], and for a gamepad nxtdrive[gamepad]."""
EXAMPLES = """\
  nxtdrive teleop
  nxtdrive teleop --nxt usb:// --speed 150
  nxtdrive teleop --gamepad
  nxtdrive teleop --target lena
  nxtdrive teleop --mission my-mission.toml     # in its own simulated room
  nxtdrive teleop --mission my-mission.toml --camera 0 --nxt usb://"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_brick_arguments(parser)
    add_robot_argument(parser)
    parser.add_argument(
        "--mission",
        metavar="FILE",
        type=Path,
        help="how the robot is built, its simulated room, and what to look for (default: built-in)",
    )
    parser.add_argument(
        "--target", metavar="NAME", help="look for this target of the mission (default: with --mission, its first)"
    )
    camera = parser.add_mutually_exclusive_group()
    camera.add_argument("--camera", metavar="SOURCE", help="as for `nxtdrive run`")
    camera.add_argument("--no-camera", dest="show_camera", action="store_false", help="drive by the map alone")
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
    from nxtdrive.mission.body import build_rover, lacking_sensors
    from nxtdrive.mission.camera import watch_frames
    from nxtdrive.mission.files import read_mission_file
    from nxtdrive.tools.teleop.app import Teleop
    from nxtdrive.tools.teleop.controls import Controls
    from nxtdrive.tools.teleop.floor_map import FloorMap
    from nxtdrive.tools.teleop.latest_frame import FPS, LatestFrame
    from nxtdrive.tools.teleop.pilot import Pilot
    from nxtdrive.tools.teleop.terminal import tolerant_terminal

    mission = read_mission_file(args.mission, args.robot)
    target = _target(args, mission)
    with ExitStack() as stack:
        gamepad = _gamepad(args.gamepad, stack)
        brick = stack.enter_context(open_brick(in_real_time(mission_brick(args))))
        rover = build_rover(brick, mission.robot)
        controls = Controls(args.speed, rover.settings.turn_deg_s)
        camera, why_none = _open_camera(args, brick, target, stack)
        latest, spotter = None, None
        if camera is not None:
            latest = LatestFrame()
            watch_frames(camera, brick, latest.frame, FPS)
            if target:
                spotter = stack.enter_context(closing(_spotter(camera, brick, mission, target, latest)))
        stopped = stack.enter_context(until_signal())
        stack.enter_context(tolerant_terminal())
        floor_map = FloorMap(mission.robot.sonar_forward_mm, mission.camera)
        pilot = Pilot(brick, rover, controls, spotter, floor_map=floor_map)
        name = brick.link.transport.address
        lacking = lacking_sensors(mission.robot)
        app = Teleop(pilot, controls, brick.now, name, gamepad, latest, why_none, lacking, stopped)
        stack.callback(app.finish)
        app.run()
    if app.failure is not None:
        raise app.failure
    return DONE


def _check() -> None:
    """Check what can be checked before the program takes over the screen."""
    require("tui", "textual", what="teleop")
    if not all(stream and stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr)):
        raise ConfigError(
            "teleop needs a terminal to draw on and to read keys from.",
            remedy="Run it in one, with input, output and standard error as they are.",
        )


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


def _open_camera(
    args: argparse.Namespace, brick: Brick, target: str | None, stack: ExitStack
) -> tuple[Camera | None, str]:
    """Return the camera, or None and why there is none; a camera that was not asked for may be missing."""
    from nxtdrive.mission.camera import default_camera, open_mission_camera
    from nxtdrive.vision.camera import ReplayCamera

    if not args.show_camera:
        return None, "no camera (--no-camera)"
    try:
        source = args.camera or default_camera(brick)
        camera = stack.enter_context(closing(open_mission_camera(source, brick)))
    except CameraError as error:
        if args.camera or args.target:
            raise
        return None, str(error.args[0])
    if isinstance(camera, ReplayCamera) and not target:
        raise ConfigError(
            f"--camera {source} is a recording, which is used only to look for a target.",
            remedy="Name one: --target NAME.",
        )
    return camera, ""


def _spotter(camera: Camera, brick: Brick, mission: Mission, target: str, latest: LatestFrame) -> Spotter:
    from nxtdrive.mission.vision import camera_vision
    from nxtdrive.tools.teleop.spotter import Spotter, ThreadedSpotter

    vision = camera_vision(camera, mission)
    vision.on_look(latest.look)
    kind = Spotter if brick.link.transport.simulated else ThreadedSpotter
    return kind(vision, target)
