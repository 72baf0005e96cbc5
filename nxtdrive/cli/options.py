"""Options that several commands share, so that they mean the same everywhere."""

from __future__ import annotations

import argparse
import os
from typing import Any

DEFAULT_ADDRESS = "sim://"


def add_action(actions: Any, name: str, summary: str) -> argparse.ArgumentParser:  # noqa: ANN401 - argparse's
    """The parser of an action; its own help begins with what the list of all actions says of it."""
    description = f"{summary[0].upper()}{summary[1:]}."
    parser: argparse.ArgumentParser = actions.add_parser(name, help=summary, description=description)
    return parser


def add_brick_arguments(parser: argparse.ArgumentParser, default: str = DEFAULT_ADDRESS) -> None:
    """``--nxt ADDRESS``: which brick, and ``--trace FILE``: a record of what is said; `main` sees to the latter."""
    parser.add_argument(
        "--nxt",
        metavar="ADDRESS",
        default=os.environ.get("NXT") or default,
        help="which brick: sim://, usb://, usb://0016530A1B2C, bt://00:16:53:0A:1B:2C, serial:///dev/rfcomm0, "
        "serial://COM5, tcp://host:port, nxt-server://host:port, replay://FILE.nxttrace; `nxtdrive list` finds some "
        f"(default: $NXT, else {default})",
    )
    parser.add_argument("--trace", metavar="FILE", help="record the conversation with the brick, see `nxtdrive trace`")


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """``--json``: output for machines."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def add_profile_argument(parser: argparse.ArgumentParser, meaning: str) -> None:
    """``--profile NAME``; ``--policy`` is its old name."""
    from behaviors.profiles.registry import PROFILES

    parser.add_argument("--profile", choices=PROFILES, help=meaning)
    parser.add_argument("--policy", choices=PROFILES, dest="profile", help=argparse.SUPPRESS)
