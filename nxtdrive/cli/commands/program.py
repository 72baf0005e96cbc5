"""``nxtdrive program``: programs on the brick."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from nxtdrive.cli.options import add_action, add_brick_arguments, add_json_argument, on_brick
from nxtdrive.cli.output import write_json, write_line

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Start and stop programs stored on a brick, and check that it worked. Starting or
stopping a program resets all motors and sensors."""
EXAMPLES = """\
  nxtdrive program status
  nxtdrive program start follow-line.rxe --nxt usb://
  nxtdrive program stop --nxt usb:// --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    start = add_action(actions, "start", "start a program and wait until it runs", on_brick(_start))
    start.add_argument("name", metavar="NAME", help="on the brick; `nxtdrive files ls '*.rxe'` lists them")
    stop = add_action(actions, "stop", "stop the running program", on_brick(_stop))
    status = add_action(actions, "status", "print which program is running", on_brick(_status))
    for action in (start, stop, status):
        add_brick_arguments(action)
        add_json_argument(action)


def _start(args: argparse.Namespace, brick: Brick) -> None:
    brick.programs.start(args.name)
    _status(args, brick)


def _stop(args: argparse.Namespace, brick: Brick) -> None:
    brick.programs.stop()
    _status(args, brick)


def _status(args: argparse.Namespace, brick: Brick) -> None:
    running = brick.programs.running
    if args.json:
        write_json({"running": running})
    else:
        write_line(f"{running} is running" if running else "no program is running")
