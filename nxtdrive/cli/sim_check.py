"""``nxtdrive sim check``: compares the simulated brick with a recorded conversation."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, NOT_ACHIEVED
from nxtdrive.cli.options import add_json_argument
from nxtdrive.cli.output import write_json, write_line, write_text

if TYPE_CHECKING:
    from nxtdrive.tools.conformance.replay import Report

FIRMWARES = ("1.29", "1.05")
"""Firmware versions the simulated brick can behave as."""


def add_check_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "recording", metavar="FILE.jsonl", type=Path, help="a recording, see docs/firmware.md section 0"
    )
    parser.add_argument(
        "--firmware", choices=FIRMWARES, default=FIRMWARES[0], help="which one to behave as (default: %(default)s)"
    )
    parser.add_argument("--scenario", metavar="NAME", action="append", help="only this scenario; may be repeated")
    add_json_argument(parser)


def check(args: argparse.Namespace) -> int:
    """Replay the recording on fresh simulated bricks and print which scenarios match.

    Raises:
        ConfigError: The file is not a recording, or has no such scenario.
    """
    from nxtdrive.tools.conformance.recording import load
    from nxtdrive.tools.conformance.replay import replay

    scenarios = load(args.recording, args.firmware)
    if unknown := sorted(set(args.scenario or ()) - scenarios.keys()):
        raise ConfigError(
            f"{args.recording} has no scenario {unknown[0]!r}.", remedy=f"It has {', '.join(list(scenarios)[:20])}."
        )
    chosen = args.scenario or scenarios
    reports = [replay(name, steps, args.firmware) for name, steps in scenarios.items() if name in chosen]
    if args.json:
        _print_json(reports, args.firmware)
    else:
        _print_text(reports, args.firmware)
    return NOT_ACHIEVED if any(report.difference for report in reports) else DONE


def _print_text(reports: list[Report], firmware: str) -> None:
    width = max(len(report.scenario) for report in reports)
    for report in reports:
        verdict = f"step {report.step}: {report.difference}" if report.difference else "same"
        write_line(f"{report.scenario:{width}}  {report.matched:4}/{report.steps:<4}  {verdict}")
    steps, matched = (sum(getattr(report, name) for report in reports) for name in ("steps", "matched"))
    same = sum(not report.difference for report in reports)
    write_text(f"\nfirmware {firmware}: {same} of {len(reports)} scenarios and {matched} of {steps} steps are the same")


def _print_json(reports: list[Report], firmware: str) -> None:
    same = sum(not report.difference for report in reports)
    scenarios = [asdict(report) for report in reports]
    write_json({"firmware": firmware, "same": same, "of": len(reports), "scenarios": scenarios})
