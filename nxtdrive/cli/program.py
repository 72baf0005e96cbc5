"""``nxtdrive program``: programs on the brick."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_action, add_brick_arguments, add_json_argument

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Start and stop programs that are on a brick, and make sure that they did. A
program that is started or stopped resets all motors and sensors."""
EXAMPLES = """\
  nxtdrive program status
  nxtdrive program start follow-line.rxe --nxt usb://
  nxtdrive program stop --nxt usb:// --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    start = add_action(actions, "start", "start a program and wait until it runs")
    start.add_argument("name", metavar="NAME", help="on the brick; `nxtdrive files ls '*.rxe'` lists them")
    start.set_defaults(action=_start)
    stop = add_action(actions, "stop", "stop the program that runs")
    stop.set_defaults(action=_stop)
    status = add_action(actions, "status", "which program runs")
    status.set_defaults(action=_status)
    for action in (start, stop, status):
        add_brick_arguments(action)
        add_json_argument(action)


def run(args: argparse.Namespace) -> int:
    """Open the brick, do what the subcommand says, and tell which program runs."""
    from nxtdrive.brick import open_brick

    with open_brick(args.nxt) as brick:
        args.action(args, brick)
        running = brick.programs.running
    if args.json:
        print(json.dumps({"running": running}))
    else:
        print(f"{running} is running" if running else "no program is running")
    return DONE


def _start(args: argparse.Namespace, brick: Brick) -> None:
    brick.programs.start(args.name)


def _stop(_: argparse.Namespace, brick: Brick) -> None:
    brick.programs.stop()


def _status(_: argparse.Namespace, brick: Brick) -> None:
    """Nothing to do: the status is printed anyway."""
