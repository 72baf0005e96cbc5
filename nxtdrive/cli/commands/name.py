"""``nxtdrive name``: prints or changes the name of a brick."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from firmware_protocol.errors import BrickBusy
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, note_simulated, on_brick
from nxtdrive.cli.output import write_json, write_line

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Print the name of a brick, or give it another one. A renamed brick beeps and shows
the name in the top line of its display; programs, files and settings on it stay as
they are. Over Bluetooth, computers that are paired with it may show the old name
until they search again."""
EXAMPLES = """\
  nxtdrive name
  nxtdrive name "Robot 7" --nxt usb://"""

LENGTH = 15
"""Source: docs/firmware.md, SetBrickName."""
BEEP_HZ, BEEP_MS = 880, 200


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        type=_name,
        help=f"the new name, 1 to {LENGTH} characters (default: print the current one)",
    )
    add_brick_arguments(parser)
    add_json_argument(parser)
    parser.set_defaults(run=on_brick(rename))


def _name(text: str) -> str:
    """Check a name; the display's font has the printable characters of ASCII."""
    if not 1 <= len(text) <= LENGTH or not (text.isascii() and text.isprintable()) or text != text.strip():
        raise argparse.ArgumentTypeError(
            f"a name has 1 to {LENGTH} letters, digits, signs and inner spaces, without accents: not {text!r}"
        )
    return text


def rename(args: argparse.Namespace, brick: Brick) -> None:
    """Print the name, or change it, check that it is changed, and beep."""
    before = brick.name
    if args.name is not None:
        brick.name = args.name
        if (now := brick.name) != args.name:
            raise BrickBusy(f"the brick is still called {now!r}.", remedy="Try again, over USB if that fails.")
        brick.tone(BEEP_HZ, BEEP_MS)
        brick.sleep(BEEP_MS / 1000)
    now = before if args.name is None else args.name
    if args.json:
        write_json({"name": now, "before": before})
    else:
        write_line(now if args.name is None else f"renamed {before!r} to {now!r}")
    if args.name is not None:
        note_simulated(brick)
