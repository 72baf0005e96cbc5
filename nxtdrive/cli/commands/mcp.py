"""``nxtdrive mcp``: the robot for an AI assistant, over the Model Context Protocol."""

from __future__ import annotations

import argparse
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import number
from nxtdrive.cli.output import write_error
from nxtdrive.cli.page_options import add_port_argument, add_server_arguments, make_robot, require_page
from nxtdrive.host.environment import require
from nxtdrive.host.listening import LOOPBACK, listen

if TYPE_CHECKING:
    from nxtdrive.tools.mcp.assistant import Assistant

DESCRIPTION = """\
Let an AI assistant that speaks the Model Context Protocol use the robot: it looks,
drives short distances, and starts missions. The assistant starts this command itself
and talks to it over standard input and output. Without a brick it gets the simulated
one in real time. It uses the robot.toml in the folder of the missions if no
other robot file is named. Needs the extra nxtdrive[mcp].

Most assistants take this entry in their settings:
  {"mcpServers": {"nxt": {"command": "/path/to/nxtdrive", "args": ["mcp"]}}}"""
EXAMPLES = """\
  nxtdrive mcp
  nxtdrive mcp --nxt usb:// --camera 0 --max-mm 300
  nxtdrive mcp --web                # people watch on a page with a STOP button"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_server_arguments(parser, "folder with the mission files that it may start")
    parser.add_argument(
        "--max-mm",
        metavar="MM",
        type=number("millimetres", float, 10, 5000),
        default=1000.0,
        help="longest distance that one call drives, 10 to 5000 (default: 1000)",
    )
    parser.add_argument(
        "--web", action="store_true", help="also serve the page of `nxtdrive web`, which has a STOP button"
    )
    add_port_argument(parser, "TCP port of --web")


def run(args: argparse.Namespace) -> int:
    """Serve until the assistant disconnects; return the exit code."""
    require("mcp", "mcp", what="the assistant's protocol")
    from nxtdrive.tools.mcp.assistant import Assistant
    from nxtdrive.tools.mcp.mission_status import MissionStatusHub
    from nxtdrive.tools.mcp.server import make_server, serve

    if args.web:
        require_page()
    status_hub = MissionStatusHub()
    robot, missions = make_robot(args, status_hub)
    assistant = Assistant(robot, status_hub, missions, args.out, args.max_mm)
    with ExitStack() as stack:
        listener = stack.enter_context(closing(listen(args.port))) if args.web else None
        stack.enter_context(closing(robot))  # also where Ctrl-C comes while it is opened
        robot.open()
        if listener is not None:
            stack.enter_context(_page(assistant, listener))
        if sys.stdin is not None and sys.stdin.isatty():  # a person tries it, and would see nothing
            write_error(
                "waiting for an assistant, which starts this command itself: `nxtdrive mcp --help` has the entry for "
                "its settings. Ctrl-C ends it."
            )
        serve(make_server(assistant), robot)
    if robot.failure:
        raise robot.failure
    return DONE


@contextmanager
def _page(assistant: Assistant, listener: socket.socket) -> Iterator[None]:
    """Serve the robot's page and print its address to standard error; standard output belongs to the protocol."""
    from nxtdrive.tools.web.app import Server, serving
    from nxtdrive.tools.web.runs import Runs

    robot = assistant.robot
    server = Server(robot, assistant.status_hub, assistant.missions, Runs(assistant.runs), str(robot.address))
    write_error(f"the page is http://{LOOPBACK}:{listener.getsockname()[1]}/")
    with serving(server, listener):
        yield
