"""Arguments of the commands that serve a page, or drive a robot for others, and the extra that they need."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.options import add_brick_arguments, add_robot_argument, tcp_port
from nxtdrive.host.environment import require

PORT = 7080


def add_server_arguments(parser: argparse.ArgumentParser, folder: str) -> None:
    """Declare the arguments of a program that drives a robot for others; `folder` describes ``--folder``."""
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
