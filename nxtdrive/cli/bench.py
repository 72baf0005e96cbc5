"""``nxtdrive bench``: measures this machine."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING

from nxtdrive.cli.options import add_json_argument

if TYPE_CHECKING:
    from nxtdrive.tools.bench import Figure

DESCRIPTION = """\
Measure this machine: encoding and decoding, a request over a link without a
brick, the same in nxt-python if it is installed, the import, the simulation with
and without a camera, and each detector. Takes about a minute."""
EXAMPLES = """\
  nxtdrive bench
  nxtdrive bench --json > figures.json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Measure and print figure by figure; a missed goal is shown, not an error."""
    from nxtdrive.tools.bench import measure_all

    figures = []
    for figure in measure_all():
        figures.append(figure)
        if not args.json:
            print(_line(figure), flush=True)
    if args.json:
        print(json.dumps([asdict(figure) for figure in figures], indent=2, ensure_ascii=False))
    return 0


def _line(figure: Figure) -> str:
    value = "" if math.isnan(figure.value) else f"{figure.value:10.3f} {figure.unit}"
    verdict = "" if figure.met is None else f"  (goal {figure.goal}: {'met' if figure.met else 'MISSED'})"
    return f"{figure.name:<62}{value}{verdict}"
