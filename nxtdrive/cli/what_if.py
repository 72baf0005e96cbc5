"""``nxtdrive what-if``: what every other candidate of a decision would have cost."""

from __future__ import annotations

import argparse
import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument, number, writing
from nxtdrive.cli.output import make_console, write_json, write_line

if TYPE_CHECKING:
    from nxtdrive.tools.sweep.what_if import Course, Drawn, Folder

DESCRIPTION = """\
Repeat a simulated mission up to each decision, take every candidate there, and say
what each would have cost: the mean seconds to the targets that were still open. Each
candidate is played in several futures, which differ in what chance decides afterwards.
docs/evaluation.md explains the regret and how its bias is removed."""
EXAMPLES = """\
  nxtdrive what-if clutter:100
  nxtdrive what-if flat:7:adaptive --decision 3 --futures 10
  nxtdrive what-if runs/lena-then-rilakkuma-001 --decision 1"""

FUTURES = 6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "run_path", metavar="RUN", help="a run's folder with a simulated robot, or CLASS:SEED[:PROFILE] of the sweep"
    )
    parser.add_argument(
        "--decision",
        metavar="N",
        type=number("decision", int, 1, math.inf),
        help="only this one, from 1 (default: all)",
    )
    parser.add_argument(
        "--futures",
        metavar="N",
        type=number("futures", int, 2, math.inf),
        default=FUTURES,
        help=f"for each candidate (default: {FUTURES})",
    )
    parser.add_argument(
        "--workers", metavar="N", type=number("processes", int, 1, math.inf), help="processes (default: one a core)"
    )
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Play all branches; returns the exit code."""
    from behaviors.mission import MissionError
    from nxtdrive.tools.sweep.runner import workers
    from nxtdrive.tools.sweep.what_if import Branch, Folder, branches, costs, play

    source = _source(args.run_path)
    try:
        base = play(Branch(source, -1, 0, None))
    except MissionError as error:
        raise ConfigError(str(error)) from None
    if isinstance(source, Folder) and [(each.time_s, each.chose) for each in base.decisions] != list(source.choices):
        raise ConfigError(
            f"{args.run_path} cannot be repeated: the same mission makes other decisions now.",
            remedy="Another version of nxtdrive, a person or another program had a part in it.",
        )
    only = None if args.decision is None else args.decision - 1
    if only is not None and only >= len(base.decisions):
        raise ConfigError(f"there is no decision {args.decision}: the mission has {len(base.decisions)}.")
    found: dict[int, dict[int, list[float]]] = {}
    with workers(args.workers or os.cpu_count() or 1) as executor:
        for branch, cost_s in costs(branches(source, base, args.futures, only), executor):
            found.setdefault(branch.decision, {}).setdefault(branch.candidate, []).append(cost_s)
    told = [_told(at, base, candidates) for at, candidates in found.items()]
    result = {"run": args.run_path, "decisions": told}
    if isinstance(source, Folder):
        _keep(source.path, result)
    if args.json:
        write_json(result, indent=2)
    else:
        _show(told)
    return DONE


def _source(name: str) -> Drawn | Folder:
    from nxtdrive.tools.sweep.what_if import Drawn, Folder
    from sim_backend.scenarios.classes import ALL_CLASSES

    kind, _, rest = name.partition(":")
    seed, _, profile = rest.partition(":")
    if kind in ALL_CLASSES and seed.isdecimal() and not os.path.exists(name):
        return Drawn(kind, int(seed), profile or "adaptive")
    if not os.path.isdir(name):
        raise ConfigError(
            f"{name} is neither a run's folder nor CLASS:SEED[:PROFILE].", remedy="Write clutter:100, for example."
        )
    return Folder.read(Path(name))


def _keep(folder: Path, result: dict[str, Any]) -> None:
    """Write the result into the run's folder, with the decisions that are known from earlier."""
    from nxtdrive.recording.explanation import what_ifs
    from nxtdrive.recording.output_file import write_file
    from nxtdrive.recording.run_folder import WHAT_IF

    known = {**what_ifs(folder), **{each["decision"]: each for each in result["decisions"]}}
    decisions = [known[at] for at in sorted(known)]
    with writing(folder / WHAT_IF, "Make room in the run's folder, or make it writable."):
        write_file(folder / WHAT_IF, (json.dumps({**result, "decisions": decisions}, indent=2) + "\n").encode())


def _told(at: int, base: Course, candidates: dict[int, list[float]]) -> dict[str, Any]:
    """Return a decision with what each candidate would have cost, as plain values."""
    import numpy as np

    from nxtdrive.tools.sweep.regret import regret
    from nxtdrive.tools.sweep.summary import estimate

    made, found = base.decisions[at], regret(np.array([candidates[number] for number in sorted(candidates)]))
    means = [estimate([(cost_s, 1.0) for cost_s in candidates[number]]) for number in sorted(candidates)]
    return {
        "decision": at + 1,
        "t": round(made.time_s, 3),
        "target": made.target,
        "reason": made.reason,
        "futures": len(candidates[0]),
        "regret_s": round(found.seconds, 2),
        "biased_regret_s": round(found.biased_s, 2),
        "beyond_best_s": [round(found.interval.mean, 2), round(found.interval.low, 2), round(found.interval.high, 2)],
        "candidates": [
            {
                "does": words,
                "chosen": number == 0,
                "best": number == found.best,
                "cost_s": [round(value, 2) for value in (mean.mean, mean.low, mean.high)],
            }
            for number, (words, mean) in enumerate(zip(made.candidates, means, strict=True))
        ],
    }


def _show(told: list[dict[str, Any]]) -> None:
    from rich.table import Table
    from rich.text import Text

    from firmware_protocol.printable import printable
    from nxtdrive.recording.wording import failure_words
    from nxtdrive.tools.sweep.regret import NEARLY_S

    console = make_console()
    for each in told:
        head = f"{each['decision']}. {each['t']:.1f} s, {each['target']}: {failure_words(each['reason'])}"
        table = Table(title=Text(printable(head)), title_justify="left")
        for column in ("", "candidate", "mean seconds to the targets left [95 %]"):
            table.add_column(column, overflow="fold")
        for candidate in each["candidates"]:
            mark = ("> " if candidate["chosen"] else "") + ("best" if candidate["best"] else "")
            mean, low, high = candidate["cost_s"]
            table.add_row(mark, Text(printable(candidate["does"])), f"{mean:.1f} [{low:.1f}, {high:.1f}]")
        console.print(table)
        write_line(f"regret {each['regret_s']:.1f} s ({each['biased_regret_s']:.1f} s with the bias)")
    if not told:
        write_line("The mission came to no decision.")
    else:
        mean = sum(each["regret_s"] for each in told) / len(told)
        good = sum(each["regret_s"] <= NEARLY_S for each in told)
        write_line(f"{len(told)} decisions: mean regret {mean:.1f} s; {good} within {NEARLY_S:g} s of the best")
