"""Arguments of the commands that let pages or assistants drive a robot, and the extra that they need."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.options import add_brick_arguments, add_robot_argument, mission_brick, tcp_port, warn_of_room
from nxtdrive.cli.pace import in_real_time
from nxtdrive.host.environment import require

if TYPE_CHECKING:
    from nxtdrive.tools.web.hub import Hub
    from nxtdrive.tools.web.missions import Missions
    from nxtdrive.tools.web.robot import Robot

PORT = 7080


def add_server_arguments(parser: argparse.ArgumentParser, folder: str) -> None:
    """Declare the arguments of a program that lets others drive a robot; `folder` describes ``--folder``."""
    add_brick_arguments(parser)
    add_robot_argument(parser)
    parser.add_argument("--camera", metavar="SOURCE", help="as for `nxtdrive run`")
    mission = "the mission proposed first, if it is in the folder, and the robot and simulated room (default: built-in)"
    parser.add_argument("--mission", metavar="FILE", type=Path, help=mission)
    parser.add_argument("--folder", metavar="FOLDER", type=Path, help=f"{folder} (default: that of --mission, else .)")
    parser.add_argument(
        "--out", metavar="FOLDER", type=Path, default=Path("runs"), help="where runs go (default: runs)"
    )


def missions_folder(args: argparse.Namespace) -> Path:
    """Return the folder of the missions.

    Raises:
        ConfigError: There is no such folder.
    """
    folder: Path = args.folder or (args.mission.parent if args.mission else Path())
    if not os.path.isdir(folder):
        raise ConfigError(f"there is no folder {folder}.", remedy="Name the folder of your missions with --folder.")
    return folder


def make_robot(args: argparse.Namespace, hub: Hub) -> tuple[Robot, Missions]:
    """Return the robot of a program that drives it for others, not open yet, and the missions that it may start.

    Raises:
        ConfigError: A folder or a file cannot be used.
        AddressError: The text of ``--nxt`` is not an address.
    """
    from nxtdrive.mission.files import read_mission_file, robot_file_of
    from nxtdrive.recording.run_folder import check_parent
    from nxtdrive.tools.web.missions import Missions
    from nxtdrive.tools.web.robot import Robot

    check_parent(args.out)
    address, folder = in_real_time(mission_brick(args)), missions_folder(args)
    default_robot = robot_file_of(folder)
    built = read_mission_file(args.mission, args.robot, default_robot)
    robot = Robot(address, args.camera, built, hub, args.out, warn_of_room)
    return robot, Missions(folder, args.robot, default_robot, args.mission)


def add_port_argument(parser: argparse.ArgumentParser, what: str, default: int = PORT) -> None:
    """Declare the argument ``--port``, described as `what`."""
    text = f"{what}; 0 takes a free one (default: {default})"
    parser.add_argument("--port", metavar="N", type=tcp_port, default=default, help=text)


def require_page() -> None:
    """Check that the packages of the page are installed.

    Raises:
        ConfigError: They are not.
    """
    require("web", "starlette", "uvicorn", "websockets", "segno", "tomlkit", what="the page")
