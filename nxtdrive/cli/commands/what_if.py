"""``nxtdrive what-if``: estimates what the other candidates of a decision would have cost."""

from __future__ import annotations

import argparse
import json
import math
import os
from itertools import zip_longest
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import number_of
from input_files.plain import whole_number
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument, number, writing
from nxtdrive.cli.output import complain, make_console, write_json, write_line
from nxtdrive.cli.workers import add_worker_arguments, open_workers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nxtdrive.tools.sweep.runner import Workers
    from nxtdrive.tools.sweep.what_if import Rollout, Source

DESCRIPTION = """\
Repeat a simulated mission up to each decision, take every candidate there, and print
what each would have cost: the mean seconds to the targets that were still open. Each
candidate is tried in several futures, which differ in their random events. A run of
a real robot is repeated in a simulated room made from its map. The regret of a decision
is the cost of its choice beyond that of the best candidate; docs/evaluation.md explains
how it is estimated without bias."""
EXAMPLES = """\
  nxtdrive what-if clutter:100
  nxtdrive what-if flat:7:adaptive --decision 3 --futures 10
  nxtdrive what-if runs/lena-then-rilakkuma-001 --decision 1
  nxtdrive what-if flat:100 before:100 --sample 3 --out regret.jsonl"""

FUTURES = 6
NEARLY = "within 3 s of the best"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "run_paths",
        metavar="RUN",
        nargs="+",
        help="a run folder, or CLASS:SEED[:PROFILE] of the sweep",
    )
    parser.add_argument(
        "--decision",
        metavar="N",
        type=number("decision", int, 1, math.inf),
        help="only this decision, counted from 1 (default: all)",
    )
    parser.add_argument(
        "--sample",
        metavar="N",
        type=number("decisions", int, 1, math.inf),
        help="only this many decisions of each mission, chosen at random, the same ones each time",
    )
    parser.add_argument(
        "--futures",
        metavar="N",
        type=number("futures", int, 2, math.inf),
        default=FUTURES,
        help=f"futures tried for each candidate (default: {FUTURES})",
    )
    parser.add_argument(
        "--out", metavar="FILE", type=Path, help="add each mission to this file; those that it has are not repeated"
    )
    add_worker_arguments(parser, os.cpu_count() or 1, "one per core")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Play all branches; return the exit code."""
    if args.decision is not None and len(args.run_paths) > 1:
        raise ConfigError("--decision is for one run.", remedy="Name one, or leave --decision out.")
    from nxtdrive.tools.sweep.what_if_file import append_mission, read_missions

    sources = {name: _source(name) for name in args.run_paths}
    kept = read_missions(args.out) if args.out else {}
    results: list[dict[str, Any]] = []
    with open_workers(args, "Repeat the command with fewer --workers.") as workers:
        for name, source in sources.items():
            result = kept.get(name) or _played(name, source, args, workers)
            results.append(result)
            if args.out and name not in kept:
                with writing(args.out):
                    append_mission(args.out, result)
            if not args.json:
                _show(name, result["decisions"])
    summary = _summary(results)
    if args.json:
        write_json({"runs": results, **summary}, indent=2)
    elif summary:
        shapes = {1: "{:.2f}", 3: "{:.2f} [{:.2f}, {:.2f}]"}
        words = {key: shapes[len(value)].format(*value) for key, value in summary.items()}
        made = number_of(sum(len(each["decisions"]) for each in results), "decision")
        write_line(f"{made}: mean regret {words['regret_s']} s; {words['nearly_best']} of them {NEARLY}")
    return DONE


def _played(name: str, source: Source, args: argparse.Namespace, workers: Workers) -> dict[str, Any]:
    """Play a mission and its branches."""
    from nxtdrive.tools.sweep.what_if import RecordedRun, all_costs, play

    if isinstance(source, RecordedRun):
        _check_number(args.decision, len(source.choices))
    complain(f"{name}: repeating the mission, to find its decisions", sender="")
    base = play(source, tell=lambda each: complain(f"{name}: a decision at {each.time_s:.0f} s", sender=""))
    if isinstance(source, RecordedRun):
        _check_repeated(name, source.choices, base)
    wanted, decisions = _wanted(base, args), []
    for done, (at, costs_s) in enumerate(all_costs(source, base, args.futures, wanted, workers), 1):
        decisions.append(_decision_values(at, base, costs_s))
        complain(f"{name}: decision {at + 1} is done, {done} of {len(wanted)}", sender="")
    result = {"run": name, "decisions": decisions}
    if isinstance(source, RecordedRun):
        _keep(source.path, result)
    return result


def _check_repeated(name: str, recorded: Sequence[tuple[float, str]], base: Rollout) -> None:
    """Raise a `ConfigError` that names the first decision in which a mission differs from its record."""
    choices = [(each.time_s, each.chose) for each in base.decisions]
    for was, now in zip_longest(recorded, choices):
        if was != now:
            then, instead = (f"{each[1]} at {each[0]:.1f} s" if each else "the end" for each in (was, now))
            raise ConfigError(
                f"{name} cannot be repeated: where it has {then}, the same mission now leads to {instead}.",
                remedy="It was made with another version of nxtdrive or of its world file, or a person or another "
                "program intervened.",
            )


def _check_number(decision: int | None, most: int) -> None:
    if decision is not None and decision > most:
        raise ConfigError(f"there is no decision {decision}: the mission has {most}.")


def _wanted(base: Rollout, args: argparse.Namespace) -> list[int]:
    """Return the numbers of the decisions to examine, from 0."""
    numbers = list(range(len(base.decisions)))
    if args.decision is not None:
        _check_number(args.decision, len(numbers))
        numbers = [args.decision - 1]
    if args.sample is not None and args.sample < len(numbers):
        numbers = sorted(Random("what if").sample(numbers, args.sample))  # noqa: S311 - to repeat, not to hide
    return numbers


def _summary(results: list[dict[str, Any]]) -> dict[str, list[float]]:
    """Return the mean regret and the share of choices that were nearly the best, with their intervals, if any."""
    from nxtdrive.tools.sweep.regret import over_missions

    regrets_s = [[float(each["regret_s"]) for each in result["decisions"]] for result in results]
    if not any(regrets_s):
        return {}
    figures = zip(("regret_s", "nearly_best"), over_missions(regrets_s), strict=True)
    return {
        name: [round(value, 3) for value in (each.mean, each.low, each.high) if math.isfinite(value)]
        for name, each in figures
    }


def _source(name: str) -> Source:
    from nxtdrive.tools.sweep.what_if import GeneratedMission, RebuiltRun, read_recorded
    from sim_backend.scenarios.classes import ALL_CLASSES

    kind, _, rest = name.partition(":")
    seed, _, profile = rest.partition(":")
    if kind in ALL_CLASSES and (number := whole_number(seed)) is not None and not os.path.exists(name):
        return GeneratedMission(kind, number, profile or "adaptive")
    if not os.path.isdir(name):
        raise ConfigError(
            f"{name} is neither a run folder nor CLASS:SEED[:PROFILE].", remedy="Write clutter:100, for example."
        )
    source = read_recorded(Path(name))
    if isinstance(source, RebuiltRun):
        world = source.scenario.world
        complain(
            f"{name} is a run of a real robot. It is played in a room made from its map, with {len(world.boxes)} "
            f"obstacles and {len(world.pictures)} targets; the robot may decide differently there."
        )
    return source


def _keep(folder: Path, result: dict[str, Any]) -> None:
    """Write the result into the run folder, with the decisions that are known from earlier."""
    from nxtdrive.recording.explanation import what_ifs
    from nxtdrive.recording.output_file import write_file
    from nxtdrive.recording.run_folder import WHAT_IF

    known = {**what_ifs(folder), **{each["decision"]: each for each in result["decisions"]}}
    decisions = [known[at] for at in sorted(known)]
    with writing(folder / WHAT_IF, "Make room in the run folder, or make it writable."):
        write_file(folder / WHAT_IF, (json.dumps({**result, "decisions": decisions}, indent=2) + "\n").encode())


def _decision_values(at: int, base: Rollout, costs_s: list[list[float]]) -> dict[str, Any]:
    """Return a decision with what each candidate would have cost, as plain values."""
    import numpy as np

    from nxtdrive.tools.sweep.regret import regret
    from nxtdrive.tools.sweep.summary import estimate

    made, found = base.decisions[at], regret(np.array(costs_s))
    means = [estimate([(cost_s, 1.0) for cost_s in each]) for each in costs_s]
    return {
        "decision": at + 1,
        "t": round(made.time_s, 3),
        "target": made.target,
        "reason": made.reason,
        "futures": len(costs_s[0]),
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


def _show(name: str, told: list[dict[str, Any]]) -> None:
    from rich.table import Table
    from rich.text import Text

    from firmware_protocol.printable import printable
    from nxtdrive.recording.wording import failure_words

    console = make_console()
    for each in told:
        head = f"{name}, {each['decision']}. {each['t']:.1f} s, {each['target']}: {failure_words(each['reason'])}"
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
        write_line(f"{name}: the mission had no decision")
