"""``nxtdrive web``: a page in the browser to watch and to drive the robot."""

from __future__ import annotations

import argparse
import socket
from contextlib import closing, suppress
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, number
from nxtdrive.cli.output import print_line
from nxtdrive.cli.pace import in_real_time
from nxtdrive.host.environment import install_extra

DESCRIPTION = """\
Watch and drive the robot in the browser: camera, map, statechart, missions, and a
pad that works on a phone. Without a brick it opens the simulated one in real time.
Needs the extra nxtdrive[web]. Only this computer can open the page."""
EXAMPLES = """\
  nxtdrive web
  nxtdrive web --nxt usb:// --camera 0
  nxtdrive web --nxt "sim://open?seed=3" --port 8000"""

PORT = 7080
HOST = "127.0.0.1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_brick_arguments(parser)
    parser.add_argument("--camera", metavar="SOURCE", help="as for `nxtdrive run`")
    parser.add_argument("--mission", metavar="FILE", type=Path, help="how the robot is built (default: built-in)")
    parser.add_argument(
        "--folder", metavar="FOLDER", type=Path, default=Path(), help="whose mission files the page offers (default: .)"
    )
    parser.add_argument(
        "--out", metavar="FOLDER", type=Path, default=Path("runs"), help="where runs go (default: runs)"
    )
    parser.add_argument(
        "--port",
        type=number("port", int, 0, 65535),
        default=PORT,
        help=f"TCP port; 0 takes a free one (default: {PORT})",
    )


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl-C; returns the exit code."""
    from importlib.util import find_spec

    if any(find_spec(name) is None for name in ("starlette", "uvicorn", "websockets")):
        raise ConfigError(
            "the page needs packages that are not installed.", remedy=f"Install them: {install_extra('web')}"
        )
    from nxtdrive.mission import setup
    from nxtdrive.tools.web.app import Server, serve
    from nxtdrive.tools.web.hub import Hub
    from nxtdrive.tools.web.missions import Missions
    from nxtdrive.tools.web.robot import Robot
    from nxtdrive.tools.web.runs import Runs

    address = in_real_time(args.nxt)
    with closing(_listen(args.port)) as listener:
        hub = Hub()
        robot = Robot(address, args.camera, setup.load(args.mission), hub, args.out)
        with closing(robot), suppress(KeyboardInterrupt):
            serve(Server(robot, hub, Missions(args.folder), Runs(args.out), str(address)), listener, print_line)
    if robot.failure:
        raise robot.failure
    print_line("ended; motors off")
    return DONE


def _listen(port: int) -> socket.socket:
    try:
        return socket.create_server((HOST, port))
    except OSError as error:
        raise ConfigError(f"cannot listen on port {port}: {error}.", remedy="Choose another --port.") from None
