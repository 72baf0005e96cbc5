"""``nxtdrive sim check``: compares the simulated brick with a recorded conversation."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import asdict
from fnmatch import filter as matching
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, NOT_ACHIEVED
from nxtdrive.cli.options import add_json_argument
from nxtdrive.cli.output import write_json, write_line, write_text
from sim_backend.firmware.versions import FIRMWARES

if TYPE_CHECKING:
    from nxtdrive.tools.conformance.replay import Report
    from nxtdrive.tools.conformance.summary import Category, DifferenceCause

LISTED = 50
"""With more scenarios than this, only those that differ are listed."""

EXAMPLE_LENGTH = 240
"""Longest example in characters; the JSON has all of it."""


def add_check_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "recording", metavar="FILE.jsonl", type=Path, help="a recording, as `nxtdrive sim record` writes it"
    )
    parser.add_argument(
        "--firmware",
        choices=FIRMWARES,
        help="which firmware to simulate (default: the one recorded, which is 1.29 where the file does not say)",
    )
    parser.add_argument(
        "--scenario", metavar="NAME", action="append", help="only these, as motor_sync_AB or 'g_motor_*'; repeatable"
    )
    parser.add_argument(
        "--causes", action="store_true", help="list the differences of all steps by cause instead of the scenarios"
    )
    add_json_argument(parser)


def check(args: argparse.Namespace) -> int:
    """Replay the recording on fresh simulated bricks and print which scenarios match.

    Raises:
        ConfigError: The file is not a recording, or has no such scenario.
    """
    from nxtdrive.tools.conformance.recording import load
    from nxtdrive.tools.conformance.replay import replay
    from nxtdrive.tools.conformance.summary import by_category, by_cause

    scenarios = load(args.recording, args.firmware or "")
    chosen = _chosen(args, list(scenarios))
    reports = [replay(name, scenarios[name].steps, scenarios[name].firmware) for name in chosen]
    categories, causes = by_category(reports), by_cause(reports)
    if args.json:
        _print_json(reports, categories, causes)
    else:
        if args.causes:
            _print_causes(causes)
        else:
            _print_scenarios(reports)
        _print_categories(categories)
        _print_total(reports)
    return NOT_ACHIEVED if causes else DONE


def _chosen(args: argparse.Namespace, names: list[str]) -> list[str]:
    """Return the names of the scenarios given by `--scenario`, in the file's order."""
    wanted: set[str] = set()
    for pattern in args.scenario or ["*"]:
        found = {pattern} & set(names) or matching(names, pattern)
        if not found:
            raise ConfigError(
                f"{args.recording} has no scenario {pattern!r}.", remedy=f"It has {', '.join(names[:20])}."
            )
        wanted.update(found)
    return [name for name in names if name in wanted]


def _print_scenarios(reports: list[Report]) -> None:
    width = max(len(report.scenario) for report in reports)
    for report in reports:
        if not report.differences and len(reports) > LISTED:
            continue
        first = next(iter(report.differences), None)
        verdict = f"step {first.step}: {first.text}" if first else "same"
        write_line(f"{report.scenario:{width}}  {report.matched:4}/{report.steps:<4}  {verdict}")


def _print_causes(causes: Iterable[DifferenceCause]) -> None:
    write_line("steps scenarios  cause")
    for cause in causes:
        write_line(f"{cause.count:5} {len(cause.scenarios):9}  {cause.cause}")
        text = cause.example if len(cause.example) <= EXAMPLE_LENGTH else cause.example[:EXAMPLE_LENGTH] + "..."
        write_line(f"{'':15}  {text}")


def _print_categories(categories: Iterable[Category]) -> None:
    write_text("\ncategory         scenarios       steps")
    for each in categories:
        scenarios, steps = f"{each.same}/{each.scenarios}", f"{each.matched}/{each.steps}"
        write_line(f"{each.category:14} {scenarios:>11} {steps:>11}")


def _print_total(reports: list[Report]) -> None:
    steps, matched = (sum(getattr(report, name) for report in reports) for name in ("steps", "matched"))
    same = sum(not report.differences for report in reports)
    result = f"{same} of {len(reports)} scenarios and {matched} of {steps} steps are the same"
    write_text(f"\nfirmware {_firmwares(reports)}: {result}")


def _firmwares(reports: list[Report]) -> str:
    return ", ".join(sorted({report.firmware for report in reports}))


def _print_json(reports: list[Report], categories: Iterable[Category], causes: Iterable[DifferenceCause]) -> None:
    write_json(
        {
            "firmware": _firmwares(reports),
            "same": sum(not report.differences for report in reports),
            "of": len(reports),
            "scenarios": [asdict(report) | {"matched": report.matched} for report in reports],
            "categories": [asdict(each) for each in categories],
            "causes": [asdict(each) for each in causes],
        }
    )
