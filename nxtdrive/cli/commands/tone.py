"""``nxtdrive tone``: plays a tone on the brick."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from nxtdrive.cli.options import add_brick_arguments, number, on_brick

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Play a tone on the brick, and wait until it has ended. This is the quickest way to
find out which of several bricks is connected."""
EXAMPLES = """\
  nxtdrive tone
  nxtdrive tone 880 200 --nxt usb://"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from nxtdrive.onboard.speaker import TONE_HZ

    parser.add_argument(
        "frequency_hz",
        metavar="HZ",
        type=number("frequency", int, *TONE_HZ),
        nargs="?",
        default=440,
        help="220 to 14080 (default: 440)",
    )
    parser.add_argument(
        "duration_ms",
        metavar="MS",
        type=number("duration", int, 10, 0xFFFF),
        nargs="?",
        default=500,
        help="10 to 65535 (default: 500)",
    )
    add_brick_arguments(parser)
    parser.set_defaults(run=on_brick(_play))


def _play(args: argparse.Namespace, brick: Brick) -> None:
    brick.tone(args.frequency_hz, args.duration_ms)
    brick.sleep(args.duration_ms / 1000)
