"""``nxtdrive what-if``: estimates what the other candidates of a decision would have cost."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from firmware_protocol.printable import printable
from firmware_protocol.wording import number_of
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument, check_writable, number, output_file
from nxtdrive.cli.output import make_console, make_table, write_error, write_json, write_line
from nxtdrive.cli.workers import add_worker_arguments, open_workers
from nxtdrive.host.writing import writing

if TYPE_CHECKING:
    from nxtdrive.recording.decision_costs import DecisionCosts
    from nxtdrive.tools.sweep.runner import Workers
    from nxtdrive.tools.sweep.what_if_file import ExaminedMission
    from nxtdrive.tools.sweep.what_if_result import Request
    from nxtdrive.tools.sweep.what_if_source import Source

DESCRIPTION = """\
Repeat a simulated mission up to each decision, take every candidate there, and print
what each would have cost: the mean seconds to the targets that were still open. Each
candidate is tried in several futures, which differ in their random events. A run of
a real robot is repeated in a simulated room made from its map. The regret of a decision
is the cost of its choice beyond that of the best candidate. That is too large, since the
lowest of several noisy means is too low; so a second regret is printed, for which half
of the futures select the best candidate and the others give its cost. At the end come
the mean regret and the share of good choices, by the failure before them and together.
A decision takes about thirty missions: begin with --decision, and with fewer --futures."""
EXAMPLES = """\
  nxtdrive what-if clutter:100
  nxtdrive what-if flat:7:adaptive --decision 3 --futures 10
  nxtdrive what-if runs/lena-then-rilakkuma-001 --decision 1
  nxtdrive what-if flat:100 before:100 --sample 3 --out regret.jsonl"""

Show = Callable[[str, "DecisionCosts"], None]

FUTURES, MAX_FUTURES = 6, 1000
"""Their default number for each candidate, and the largest, which takes days."""
NEARLY = "within 3 s of the best"
STORAGE_REMEDY = "Free space for the run folder, or make it writable."


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
        help="only this many decisions of each mission, chosen at random, the same ones each time (default: all)",
    )
    parser.add_argument(
        "--futures",
        metavar="N",
        type=number("futures", int, 2, MAX_FUTURES),
        default=FUTURES,
        help=f"futures tried for each candidate (default: {FUTURES})",
    )
    parser.add_argument(
        "--redraw-unseen",
        action="store_true",
        help="in each future, hang the targets that have not been in view at another place that has not been in view: "
        "what a choice was worth with what could be known",
    )
    parser.add_argument(
        "--out",
        metavar="FILE",
        type=output_file,
        help="add each mission to this file; those that it has from the same options are not repeated",
    )
    add_worker_arguments(parser, os.cpu_count() or 1, "one per core")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Run all branches; return the exit code."""
    if args.decision is not None and len(args.run_paths) > 1:
        raise ConfigError("--decision is for one run.", remedy="Name one, or leave --decision out.")
    from nxtdrive.tools.sweep.result_file import ResultFile
    from nxtdrive.tools.sweep.what_if_file import read_missions
    from nxtdrive.tools.sweep.what_if_result import Request, figures_by_reason, mean_figures
    from nxtdrive.tools.sweep.what_if_source import read_source

    sources = {source.name: source for source in map(read_source, args.run_paths)}
    kept = read_missions(args.out) if args.out else {}
    request = Request(args.decision, args.sample, args.futures, args.redraw_unseen)
    results: list[ExaminedMission] = []
    show = None if args.json else _show
    with (
        # before minutes of work, which could not be kept
        ResultFile(args.out, remedy="Free some space, and repeat the command.") if args.out else nullcontext() as file,
        open_workers(args, "Repeat the command with fewer --workers.") as workers,
    ):
        for name, source in sources.items():
            result = kept.get(request.key(name))
            if result is None:
                result = request.answered(name, list(_examined(name, source, request, workers, show)))
                if file:
                    file.append(result.to_json())
            elif show:
                for each in result.decisions:
                    show(name, each)
            if show and not result.decisions:
                write_line(f"{name}: the mission had no decision")
            results.append(result)
    figures, by_reason = mean_figures(results), figures_by_reason(results)
    decisions = [each for result in results for each in result.decisions]
    alone = sum(not each.has_alternative for each in decisions)
    if args.json:
        runs = [each.plain() for each in results]
        write_json({"runs": runs, "without_alternative": alone, **figures, "by_reason": by_reason}, indent=2)
        return DONE
    if len(by_reason) > 1:
        _show_reasons(by_reason)
    if figures:
        regret, good, bad = _figures_words(figures)
        counted = number_of(len(decisions) - alone, "decision")
        write_line(f"{counted}: mean regret {regret}; {good} of them {NEARLY}, {bad} certainly not")
    if alone:
        counted = "is not counted" if alone == 1 else "are not counted"
        write_line(f"{number_of(alone, 'choice')} had no alternative and {counted}")
    return DONE


def _figures_words(figures: Mapping[str, Sequence[float]]) -> tuple[str, str, str]:
    """Return the mean regret and the shares of choices nearly the best and certainly not, in words."""
    good, bad = (
        _with_interval([100 * each for each in figures[name]], 0, " %") for name in ("nearly_best", "certainly_worse")
    )
    return _with_interval(figures["regret_s"], 1, " s"), good, bad


def _show_reasons(by_reason: Mapping[str, Mapping[str, Any]]) -> None:
    """Print the figures of the decisions after each failure."""
    from nxtdrive.recording.wording import spaced

    table = make_table("decisions after", "number", "mean regret", NEARLY, "certainly not")
    for reason, figures in by_reason.items():
        table.add_row(printable(spaced(reason)), str(figures["decisions"]), *_figures_words(figures))
    make_console().print(table)


def _with_interval(figure: Sequence[float], digits: int, unit: str = "") -> str:
    """Return a figure with its interval, if it has one: [value] or [value, low, high]."""
    value, *ends = (f"{each:.{digits}f}" for each in figure)
    return f"{value}{unit}" + (f" [{', '.join(ends)}]" if ends else "")


def _examined(
    name: str, source: Source, request: Request, workers: Workers, show: Show | None
) -> Iterator[DecisionCosts]:
    """Run a mission and its branches; show each decision and keep it in the run folder once it is known."""
    from nxtdrive.recording.run_folder import WHAT_IF
    from nxtdrive.tools.sweep.what_if_result import examine, keep
    from nxtdrive.tools.sweep.what_if_source import RecordedRun

    keeps = isinstance(source, RecordedRun) and not request.redraw_unseen
    if keeps:
        check_writable(source.path / WHAT_IF, STORAGE_REMEDY)
    for each in examine(name, source, request, workers, lambda text: write_error(text, sender="")):
        if keeps:
            with writing(source.path, STORAGE_REMEDY):
                keep(source.path, name, each)
        if show:
            show(name, each)
        yield each


def _show(name: str, decision: DecisionCosts) -> None:
    from rich.text import Text

    from nxtdrive.recording.wording import reason_words

    head = f"{name}, {decision.decision}. {decision.time_s:.1f} s, {decision.target}: "
    title = Text(printable(head + reason_words(decision.reason)))
    columns = ("", "candidate", "mean seconds to the targets left [95 %]")
    table = make_table(*columns, title=title, title_justify="left")
    for candidate in decision.candidates:
        mark = ("> " if candidate.chosen else "") + ("best" if candidate.best and decision.has_alternative else "")
        table.add_row(mark, Text(printable(candidate.does)), _with_interval(candidate.cost_s, 1))
    make_console().print(table)
    regret = f"regret {decision.regret_s:.1f} s ({decision.biased_regret_s:.1f} s with the bias)"
    write_line(regret if decision.has_alternative else "there was no alternative")
