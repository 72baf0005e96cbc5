"""``nxtdrive bench``: measures this machine."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.options import add_json_argument

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nxtdrive.tools.bench import Figure

DESCRIPTION = """\
Measure this machine, area by area: encoding and requests (next to bare struct),
the import, the simulation with and without a camera, each detector, the doors of
the simulated brick, the mind (facts, frames, decisions, missions a minute),
motion, sensors. Where nxt-python has a counterpart it is measured in the same
run, in a process of its own, and a table at the end shows both; `driver` stands
for all areas where that can be. Without areas everything is measured, which takes
some minutes. With --nxt, motion is measured on a real brick with a free motor on
port A."""
EXAMPLES = """\
  nxtdrive bench
  nxtdrive bench protocol simulation
  nxtdrive bench mind
  nxtdrive bench driver --out figures.json
  nxtdrive bench motion --nxt usb://"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    from nxtdrive.tools.bench import AREAS, DRIVER, DRIVER_AREAS

    known = f"{', '.join(AREAS)}; {DRIVER} is {', '.join(DRIVER_AREAS)}"
    parser.add_argument("areas", metavar="AREA", nargs="*", help=f"what to measure: {known} (default: all)")
    parser.add_argument("--nxt", metavar="ADDRESS", help="a real brick to measure motion on")
    parser.add_argument("--out", metavar="FILE", type=Path, help="keep the figures in a file, too, as JSON")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Measure and print figure by figure; a missed goal is shown, not an error."""
    from nxtdrive.tools.bench import circumstances, measure

    areas = _areas(args.areas, args.nxt)
    _write(args.out, "")  # a file that cannot be written is said before minutes of measuring
    before, figures = circumstances(), []
    for area in areas:
        for figure in measure(area, args.nxt):
            figures.append(figure)
            if not args.json:
                print(_line(figure), flush=True)
    told = {"before": before, "after": circumstances(), "figures": [_plain(figure) for figure in figures]}
    text = json.dumps(told, indent=2, ensure_ascii=False)
    _write(args.out, text + "\n")
    if args.json:
        print(text)
    else:
        _print_comparison([figure for figure in figures if figure.peer is not None])
    return 0


def _write(path: Path | None, text: str) -> None:
    if path is not None:
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise ConfigError(f"{path} cannot be written: {error.strerror}.", remedy="Name another --out.") from error


def _plain(figure: Figure) -> dict[str, object]:
    """JSON has no NaN."""
    return {key: None if isinstance(each, float) and math.isnan(each) else each for key, each in asdict(figure).items()}


def _print_comparison(figures: Sequence[Figure]) -> None:
    """The figures that nxt-python has, too."""
    if not figures:
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("measured in this run", "unit")
    for name in ("nxtdrive", "nxt-python"):
        table.add_column(name, justify="right")
    for figure in figures:
        table.add_row(figure.name, figure.unit, f"{figure.value:.3g}", f"{figure.peer:.3g}")
    # a table that is read by a program or kept in a file must not be cut to a terminal's width
    (Console() if sys.stdout.isatty() else Console(width=120)).print(table)


def _areas(wanted: list[str], address: str | None) -> list[str]:
    """The areas to measure.

    Raises:
        ConfigError: There is no such area, or it cannot be measured on a real brick.
    """
    from nxtdrive.tools.bench import AREAS, DRIVER, DRIVER_AREAS, REAL_AREAS

    wanted = [area for word in wanted for area in (DRIVER_AREAS if word == DRIVER else (word,))]
    known = REAL_AREAS if address else tuple(AREAS)
    for area in wanted:
        if area not in known:
            where = "on a real brick" if address else "here"
            names = ", ".join(known if address else (*known, DRIVER))
            raise ConfigError(f"There is no area {area!r} to measure {where}.", remedy=f"Choose from: {names}.")
    return wanted or list(known)


def _line(figure: Figure) -> str:
    value = "" if math.isnan(figure.value) else f"{figure.value:10.3f} {figure.unit}"
    verdict = "" if figure.met is None else f"  (goal {figure.goal}: {'met' if figure.met else 'MISSED'})"
    return f"{figure.name:<62}{value}{verdict}"
