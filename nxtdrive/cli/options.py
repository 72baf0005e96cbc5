"""Options that several commands share, so that they mean the same everywhere."""

from __future__ import annotations

import argparse
import os

DEFAULT_ADDRESS = "sim://"


def add_brick_arguments(parser: argparse.ArgumentParser) -> None:
    """``--nxt ADDRESS``: which brick."""
    parser.add_argument(
        "--nxt",
        metavar="ADDRESS",
        default=os.environ.get("NXT") or DEFAULT_ADDRESS,
        help="which brick: sim://, usb://, usb://0016530A1B2C, serial:///dev/rfcomm0, serial://COM5, tcp://host:port "
        "(default: $NXT, else the simulated brick)",
    )


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """``--json``: output for machines."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
