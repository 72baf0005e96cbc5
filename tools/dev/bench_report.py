"""Measure areas and report the figures: one per line, as a comparison with nxt-python, or as JSON."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from firmware_protocol.errors import ConfigError

from . import bench
from .bench import Figure


def report(areas: list[str], address: str | None, out: Path | None, *, as_json: bool) -> None:
    """Measure and print figure by figure; a missed goal is reported, but is not an error.

    Args:
        areas: Names from `bench.AREAS`, or `bench.DRIVER`; all areas when empty.
        address: A real brick, for areas that can be measured on one; None for the simulator.
        out: File for the figures as JSON, or None.
        as_json: Print JSON only.

    Raises:
        ConfigError: There is no such area, or `out` cannot be written.
    """
    areas = _areas(areas, address)
    _write(out, "")  # a file that cannot be written is reported before minutes of measuring
    before, figures = bench.conditions(), []
    for area in areas:
        for figure in bench.measure(area, address):
            figures.append(figure)
            if not as_json:
                print(_line(figure), flush=True)
    measured = {"before": before, "after": bench.conditions(), "figures": [_plain(figure) for figure in figures]}
    text = json.dumps(measured, indent=2, ensure_ascii=False)
    _write(out, text + "\n")
    if as_json:
        print(text)
    else:
        _print_comparison([figure for figure in figures if figure.peer is not None])


def _write(path: Path | None, text: str) -> None:
    if path is not None:
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise ConfigError(f"{path} cannot be written: {error.strerror}.", remedy="Choose another --out.") from error


def _plain(figure: Figure) -> dict[str, object]:
    """Convert a figure to JSON's types: NaN becomes None."""
    return {key: None if isinstance(each, float) and math.isnan(each) else each for key, each in asdict(figure).items()}


def _print_comparison(figures: Sequence[Figure]) -> None:
    """Print a table of the figures that have a counterpart in nxt-python."""
    if not figures:
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("measured in this run", "unit")
    for name in ("nxtdrive", "nxt-python"):
        table.add_column(name, justify="right")
    for figure in figures:
        table.add_row(figure.name, figure.unit, f"{figure.value:.3g}", f"{figure.peer:.3g}")
    # a table written to a file or pipe must not be cut to a terminal's width
    (Console() if sys.stdout.isatty() else Console(width=120)).print(table)


def _areas(wanted: list[str], address: str | None) -> list[str]:
    """Return the areas to measure.

    Raises:
        ConfigError: There is no such area, or it cannot be measured on a real brick.
    """
    wanted = [area for word in wanted for area in (bench.DRIVER_AREAS if word == bench.DRIVER else (word,))]
    known = bench.REAL_AREAS if address else tuple(bench.AREAS)
    for area in wanted:
        if area not in known:
            where = "on a real brick" if address else "here"
            names = ", ".join(known if address else (*known, bench.DRIVER))
            raise ConfigError(f"there is no area {area!r} to measure {where}.", remedy=f"Choose from: {names}.")
    return wanted or list(known)


def _line(figure: Figure) -> str:
    value = "" if math.isnan(figure.value) else f"{figure.value:10.3f} {figure.unit}"
    verdict = "" if figure.met is None else f"  (goal {figure.goal}: {'met' if figure.met else 'MISSED'})"
    return f"{figure.name:<62}{value}{verdict}"
