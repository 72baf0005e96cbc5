"""``nxtdrive bench``: measures this machine. The benchmarks themselves are available in a checkout only."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument, output_file

DESCRIPTION = """\
Measure this machine, area by area: protocol (encoding and requests, next to bare
struct), import, simulation (with and without a camera), firmware (the simulated
brick's telegrams, passes, memory and programs), detectors, doors (the simulated
brick's ports for other programs), behaviors (events, frames, decisions, missions
per minute), motion, nxt-python (its turns and ours), sensors, web (delays and
CPU time of the page), classroom (CPU time and lag of twelve simulated robots).
The last two need the extra nxtdrive[web]. Where nxt-python has a counterpart, it
is measured in the same run in a separate process, and a table at the end shows
both; `driver` selects all areas with such figures. Without areas everything is
measured, which takes some minutes. With --nxt, motion is measured on a real brick
with a free motor on port A. The command needs a checkout of nxtdrive: run it
there."""
EXAMPLES = """\
  nxtdrive bench
  nxtdrive bench protocol simulation
  nxtdrive bench behaviors
  nxtdrive bench driver --out figures.json
  nxtdrive bench motion --nxt usb://"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("areas", metavar="AREA", nargs="*", help="what to measure (default: everything)")
    parser.add_argument("--nxt", metavar="ADDRESS", help="a real brick to measure motion on")
    parser.add_argument("--out", metavar="FILE", type=output_file, help="also write the figures to this file, as JSON")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Measure with the checkout that holds this package, or with the one in the current folder.

    Raises:
        ConfigError: There is neither.
    """
    if find_spec("nxtdrive.tools.dev"):
        from nxtdrive.tools.dev.bench_report import report

        report(args.areas, args.nxt, args.out, as_json=args.json)
        return DONE
    checkout = Path.cwd()
    if not (checkout / "tools" / "dev" / "bench_report.py").is_file():
        raise ConfigError(
            "`nxtdrive bench` needs a checkout of nxtdrive; the benchmarks are not installed.",
            remedy="Get the repository with git, change into its folder and run the command again there.",
        )
    return _run_in(checkout, args)


def _run_in(checkout: Path, args: argparse.Namespace) -> int:
    """Run the command with the checkout's own code, not mixed with modules of an installed nxtdrive."""
    words = [*args.areas]
    for option, value in (("--nxt", args.nxt), ("--out", args.out)):
        words += [] if value is None else [option, str(value)]
    words += [f"--{flag}" for flag in ("json", "verbose") if getattr(args, flag)]
    path = os.pathsep.join(filter(None, (str(checkout), os.environ.get("PYTHONPATH"))))
    return subprocess.call(  # noqa: S603 - our own interpreter
        [sys.executable, "-m", "nxtdrive", "bench", *words], env={**os.environ, "PYTHONPATH": path}
    )
