"""``nxtdrive bench``: measures this machine."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.options import add_json_argument

if TYPE_CHECKING:
    from nxtdrive.tools.bench import Figure

DESCRIPTION = """\
Measure this machine, area by area: encoding and requests (next to bare struct and
nxt-python), the import, the simulation with and without a camera, each detector,
the doors of the simulated brick, motion. Without areas all of them, which takes
some minutes. With --nxt, motion is measured on a real brick with a free motor on
port A."""
EXAMPLES = """\
  nxtdrive bench
  nxtdrive bench protocol simulation
  nxtdrive bench motion --nxt usb://
  nxtdrive bench --json > figures.json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    from nxtdrive.tools.bench import AREAS

    parser.add_argument("areas", metavar="AREA", nargs="*", help=f"what to measure: {', '.join(AREAS)} (default: all)")
    parser.add_argument("--nxt", metavar="ADDRESS", help="a real brick to measure motion on")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Measure and print figure by figure; a missed goal is shown, not an error."""
    from nxtdrive.tools.bench import measure

    figures = []
    for area in _areas(args.areas, args.nxt):
        for figure in measure(area, args.nxt):
            figures.append(figure)
            if not args.json:
                print(_line(figure), flush=True)
    if args.json:
        print(json.dumps([asdict(figure) for figure in figures], indent=2, ensure_ascii=False))
    return 0


def _areas(wanted: list[str], address: str | None) -> list[str]:
    """The areas to measure.

    Raises:
        ConfigError: There is no such area, or it cannot be measured on a real brick.
    """
    from nxtdrive.tools.bench import AREAS, REAL_AREAS

    known = REAL_AREAS if address else tuple(AREAS)
    for area in wanted:
        if area not in known:
            where = "on a real brick" if address else "here"
            raise ConfigError(
                f"There is no area {area!r} to measure {where}.", remedy=f"Choose from: {', '.join(known)}."
            )
    return wanted or list(known)


def _line(figure: Figure) -> str:
    value = "" if math.isnan(figure.value) else f"{figure.value:10.3f} {figure.unit}"
    verdict = "" if figure.met is None else f"  (goal {figure.goal}: {'met' if figure.met else 'MISSED'})"
    return f"{figure.name:<62}{value}{verdict}"
