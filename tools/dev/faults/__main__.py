"""``python -m tools.dev.faults``: run fault campaigns and print their figures."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from pathlib import Path

from . import reference_firmware
from .campaign import Campaign, Tally, batch_of, run_campaign
from .program_mutation import COMPILED

CAMPAIGNS: tuple[str, ...] = (
    "telegrams",
    "menus",
    "programs",
    "replies",
    "links",
    "missions",
    "signals",
    "soak",
    "errors",
    "files",
    "models",
    "servers",
)
"""The modules of this folder that hold a campaign, in the order of docs/reliability.md."""

_REFERENCE_OPTIONS = {
    "--reference": "compare the programs with this firmware, which answers the lines of docs/firmware.md section 0.1",
    "--poisoned": "the same firmware with other bytes in memory that it does not initialise",
}

SHOWN = 10
"""Violations printed for each campaign."""


def load(name: str) -> Campaign:
    """Return the campaign of the module `name`."""
    campaign: Campaign = importlib.import_module(f"{__package__}.{name}").CAMPAIGN
    return campaign


def main(argv: list[str] | None = None) -> int:
    """Run the campaigns; returns 1 if a guarantee was violated."""
    args = _arguments(argv)
    broken = 0
    for name in args.campaigns or CAMPAIGNS:
        campaign = load(name)
        if name == "programs" and args.reference:
            campaign = reference_firmware.campaign(
                reference_firmware.parse(args.reference, args.poisoned), args.compiled
            )
        if args.only is not None:
            tally = campaign.run(args.seed, batch_of(campaign, args.only))
            _print(name, campaign, len(batch_of(campaign, args.only)), tally, args.seed, 0.0)
        else:
            tally = _run(name, campaign, args)
        broken += len(tally.violations)
    return 1 if broken else 0


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tools.dev.faults",
        description="Test what nxtdrive guarantees, many times, and count violations.",
    )
    parser.add_argument("campaigns", nargs="*", metavar="CAMPAIGN", help=f"of: {', '.join(CAMPAIGNS)} (default: all)")
    parser.add_argument("--count", type=int, help="number of trials (default: the campaign's own)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, metavar="NUMBER", help="reproduce one trial")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    for option, text in _REFERENCE_OPTIONS.items():
        parser.add_argument(option, metavar="VERSION=COMMAND", action="append", default=[], help=text)
    parser.add_argument(
        "--compiled", type=Path, default=COMPILED, help="with --reference: folder of the programs to damage"
    )
    args = parser.parse_args(argv)
    if unknown := set(args.campaigns) - set(CAMPAIGNS):
        parser.error(f"no campaign {', '.join(sorted(unknown))}; there are: {', '.join(CAMPAIGNS)}")
    return args


def _run(name: str, campaign: Campaign, args: argparse.Namespace) -> Tally:
    count = args.count or campaign.count
    begun = time.perf_counter()
    tally = Tally()
    for made, so_far in run_campaign(campaign, args.seed, count, args.workers):
        tally = so_far
        if sys.stderr.isatty():
            print(f"\r{name}: {made} of {count}, {len(tally.violations)} violations", end="", file=sys.stderr)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    _print(name, campaign, count, tally, args.seed, time.perf_counter() - begun)
    return tally


def _print(name: str, campaign: Campaign, count: int, tally: Tally, seed: int, seconds: float) -> None:
    """Print the campaign's figures and its first violations."""
    print(f"{name}: {count} {campaign.unit}, {len(tally.violations)} violations (seed {seed}, {seconds:.0f} s)")
    if tally.longest_s:
        print(f"  longest: {tally.longest_s:.1f} s of processor time")
    for outcome, times in sorted(tally.outcomes.items()):
        print(f"  {times:8d} {outcome}")
    for violation in tally.violations[:SHOWN]:
        print(f"  violated in trial {violation.number}: {violation.text}")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
