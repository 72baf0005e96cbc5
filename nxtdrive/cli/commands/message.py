"""``nxtdrive message``: mailboxes of the program running on the brick."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from firmware_protocol.errors import MailboxEmpty
from nxtdrive.cli.options import add_action, add_brick_arguments, add_json_argument, number, on_brick
from nxtdrive.cli.output import write_json, write_line

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Write a message to a mailbox of the program running on the brick, or read one that
the program has written. Mailboxes are 1 to 10, as in LEGO's software; without a
running program there are none. A program in NXC sends by SendResponseString."""
EXAMPLES = """\
  nxtdrive message write 1 "go left"
  nxtdrive message read 1
  nxtdrive message read 1 --wait 5 --json"""

POLL_S = 0.1
"""Time between two polls of a mailbox."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    box = number("box", int, 1, 10)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    write = add_action(actions, "write", "write a message to a mailbox", on_brick(_write))
    write.add_argument("box", metavar="BOX", type=box, help="1 to 10")
    write.add_argument("text", metavar="TEXT", help="at most 58 characters")
    read = add_action(actions, "read", "read a message from the program", on_brick(_read))
    read.add_argument("box", metavar="BOX", type=box, help="1 to 10")
    read.add_argument("--keep", action="store_true", help="do not remove it from the mailbox")
    read.add_argument(
        "--wait",
        metavar="S",
        type=number("seconds", float, 0, 3600),
        default=0.0,
        help="wait up to S seconds for one (default: 0)",
    )
    add_json_argument(read)
    for action in (write, read):
        add_brick_arguments(action)


def _write(args: argparse.Namespace, brick: Brick) -> None:
    brick.programs.write_message(args.box, args.text)


def _read(args: argparse.Namespace, brick: Brick) -> None:
    deadline = brick.now() + args.wait
    while True:
        try:
            text = brick.programs.read_message(args.box, remove=not args.keep)
            break
        except MailboxEmpty:
            if brick.now() >= deadline:
                raise
            brick.sleep(POLL_S)
    if args.json:
        write_json({"box": args.box, "text": text})
    else:
        write_line(text)
