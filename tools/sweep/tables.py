"""Format a sweep's figures as tables for a terminal and for documents."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from rich.text import Text

from behaviors.recoveries import RECOVERIES
from firmware_protocol.printable import printable

from .agents import ALL_NAMES
from .calibration import calibration_error, error_of_true_chances, pairs, reliability
from .causes import FITTING, FailureCause
from .chart_coverage import coverage_words
from .differences import against, beyond
from .mission_result import MissionResult
from .summary import (
    FIGURES,
    HEADLINE,
    PAIRED,
    REACHED_BY_S,
    Estimate,
    by,
    estimate,
    estimate_share,
    figures,
    given_up_s,
    longest_run,
    percentiles,
    recognition_s,
    soonest_s,
    success_by,
    success_rate,
    times_to_goal_s,
)

Rows = list[list[str]]
BAR = 20
"""Characters of a bar from 0 to 1."""
CHANCE_COLUMNS = ["agent", "chances", "choices", "predicted", "succeeded", "0" + "1".rjust(BAR)]

FRAME = 3
"""Characters of a column besides its text: a border and two spaces."""
MORE_COLUMNS = [label for label, figure in HEADLINE.items() if not figure.share]
"""Headline figures of a table of their own."""
Results = Sequence[MissionResult]
Cell = Callable[[Results, Mapping[str, Estimate]], str]
"""Writes a cell of a row about an agent, from its results and their figures."""


def _means(*names: str) -> dict[str, Cell]:
    """Return columns with the means of some figures."""
    return {FIGURES[name].label: _mean(name, FIGURES[name].digits) for name in names}


def _mean(name: str, digits: int) -> Cell:
    return lambda _, known: _number(known[name].mean, digits)


AGENT_COLUMNS: dict[str, Cell] = {
    "success [95 %]": lambda _, known: interval(known["success"]),
    **_means("spl", "soft_spl", "sct", "all_targets", "contacts", "contact_free"),
    FIGURES["wrong_stops"].label: lambda _, known: _number(100 * known["wrong_stops"].mean, 1, " %"),
    **_means("duration_s"),
    "to goal s p50 / p90": lambda group, _: _pair(percentiles(times_to_goal_s(group)), 0),
}
OVERVIEW = {
    "success [95 %]": "targets reached [95 %]",
    "SPL": "path efficiency",
    "contacts": "contacts per mission",
    "wrong stops": "wrong stops",
    "mission s": "seconds per mission",
}
"""Columns of the overview, and what they are called there."""
RECOVERY_COLUMNS: dict[str, Cell] = {
    "noticed s p50 / p90": lambda group, _: _pair(percentiles(recognition_s(group)), 1),
    **_means("fitting_choices", "regret_s"),
    "leaves an absent target s p50": lambda group, _: _pair(percentiles(given_up_s(group), [50]), 0),
    "longest run": lambda group, _: str(longest_run(group)),
    "soonest s": lambda group, _: _pair([soonest_s(group)], 1),
}


def agent_rows(results: Results, cells: Collection[Cell] = AGENT_COLUMNS.values()) -> Rows:
    """Return a row for each agent: its name, then these cells."""
    rows = []
    for agent, group in _by_agent(results).items():
        known = figures(group)
        rows.append([agent, *(cell(group, known) for cell in cells)])
    return rows


def class_rows(results: Results) -> tuple[list[str], Rows]:
    """Return success by class and agent: the column names, and a row for each class."""
    agents = list(_by_agent(results))
    rows = []
    for kind, group in by(results, "kind").items():
        cells = _by_agent(group)
        rows.append([kind, *(_success(cells.get(agent, [])) for agent in agents)])
    return ["class", *agents], rows


def cause_rows(results: Results) -> tuple[list[str], Rows]:
    """Return how often the choice fitted, by cause: the column names, and a row for each agent."""
    causes = sorted({choice.cause for result in results for choice in result.choices})
    rows = []
    for agent, group in _by_agent(results).items():
        choices = [choice for result in group for choice in result.choices]
        cells = [[choice.fits for choice in choices if choice.cause == cause] for cause in causes]
        rows.append([agent, *(f"{sum(cell)} of {len(cell)}" for cell in cells)])
    return ["agent", *causes], rows


def choice_rows(results: Results) -> tuple[list[str], Rows]:
    """Return the choices by agent and cause: the column names, and a row for each agent and cause."""
    rows = []
    for agent, group in _by_agent(results).items():
        choices = [choice for result in group for choice in result.choices]
        for cause in FailureCause:
            chosen = Counter(choice.choice for choice in choices if choice.cause == cause)
            others = chosen.total() - sum(chosen[kind] for kind in FITTING.values())
            if chosen:
                counts = [str(chosen[kind]) for kind in FITTING.values()]
                rows.append([agent, cause, FITTING[cause], *counts, str(others)])
    return ["agent", "cause", "fitting", *FITTING.values(), "other"], rows


def reached_rows(results: Results) -> Rows:
    """Return the share of the targets that each agent had reached by each of `REACHED_BY_S`."""
    shares = [success_by(time_s) for time_s in REACHED_BY_S]
    return [
        [agent, *(interval(estimate_share([share(result) for result in group])) for share in shares)]
        for agent, group in _by_agent(results).items()
    ]


def headline_rows(results: Results) -> Rows:
    """Return the headline figures of each agent that "targets reached by" does not have, with intervals."""
    known = {agent: figures(group, HEADLINE) for agent, group in _by_agent(results).items()}
    return [[agent, *(interval(each[name]) for name in MORE_COLUMNS)] for agent, each in known.items()]


def difference_rows(results: Results, reference: str) -> Rows:
    """Return by how much each agent's figures exceed the reference's on the same scenarios."""
    groups = _by_agent(results)
    base = groups.pop(reference, None)
    more = {agent: beyond(group, base) for agent, group in groups.items()} if base else {}
    return [[agent, *(interval(value, signed=True) for value in each.values())] for agent, each in more.items()]


def against_rows(results: Results, earlier: Results) -> Rows:
    """Return by how much each agent's figures exceed those in another sweep, by class and together."""
    return [
        [agent, kind, *(interval(value, signed=True) for value in more.values())]
        for agent, classes in against(results, earlier).items()
        for kind, more in classes.items()
    ]


def chance_rows(results: Results) -> Rows:
    """Return the reliability diagram: for each agent and range of chances their mean, and the share that succeeded."""
    rows = []
    for agent, group in _by_agent(results).items():
        for each in reliability(pairs(group)):
            said, true = round(each.predicted * BAR), round(each.came_true * BAR)
            bar = "".join("|" if i == said else "#" if i < true else "." for i in range(BAR + 1))
            span = f"{each.low:.1f} to {each.high:.1f}"
            rows.append([agent, span, str(each.number), f"{each.predicted:.2f}", f"{each.came_true:.2f}", bar])
    return rows


def calibration_rows(results: Results) -> Rows:
    """Return each agent's calibration error, that of true chances, and by choice the mean chance and the successes."""
    rows = []
    for agent, group in _by_agent(results).items():
        if not (error := calibration_error(group)).number:
            continue
        parts = [(name, pairs(group, name)) for name in RECOVERIES]
        predicted = [_predicted(part) for _, part in parts]
        rows.append([agent, interval(error), f"{error_of_true_chances(group):.3f}", *predicted])
    return rows


def _predicted(part: NDArray[np.float64]) -> str:
    return f"{part[:, 0].mean():.2f} / {part[:, 1].mean():.2f} ({len(part)})" if len(part) else "-"


def print_overview(results: Results, console: Console) -> None:
    """Print how the agents did, in all missions and by class."""
    rows = agent_rows(results, [AGENT_COLUMNS[name] for name in OVERVIEW])
    _print(console, "agents", *_with_broken(["agent", *OVERVIEW.values()], rows, results))
    _print(console, "targets reached by class", *class_rows(results))
    _print_failures(results, console)


def print_tables(results: Results, console: Console) -> None:
    """Print all tables."""
    _print(console, "agents", *_with_broken(["agent", *AGENT_COLUMNS], agent_rows(results), results))
    _print(
        console,
        "targets reached by [95 %]",
        ["agent", *(f"{time_s:.0f} s" for time_s in REACHED_BY_S)],
        reached_rows(results),
    )
    _print(console, "headline figures [95 %]", ["agent", *MORE_COLUMNS], headline_rows(results))
    _print(console, "success by class", *class_rows(results))
    if any(result.choices for result in results):
        recoveries = agent_rows(results, RECOVERY_COLUMNS.values())
        _print(console, "recovery", ["agent", *RECOVERY_COLUMNS], recoveries)
        _print(console, "choices that fitted, by cause", *cause_rows(results))
        _print(console, "what was chosen, by cause", *choice_rows(results), keys=2)
    if chances := calibration_rows(results):
        columns = ["agent", "ECE [95 %]", "true chances' ECE", *RECOVERIES]
        _print(console, "chances: mean predicted / succeeded", columns, chances)
        _print(console, "reliability: | predicted, # succeeded", CHANCE_COLUMNS, chance_rows(results), keys=2)
    if differences := difference_rows(results, "thesis"):
        _print(console, "beyond the thesis, paired [95 %]", ["agent", *PAIRED], differences)
    if covered := coverage_words(results):
        console.print(covered, markup=False)
    _print_failures(results, console)


def print_against(results: Results, earlier: Results, file: str, console: Console) -> None:
    """Print by how much the figures exceed those in another sweep's file on the same scenarios."""
    columns = ["agent", "class", *PAIRED]
    _print(console, f"beyond {printable(file)}, paired [95 %]", columns, against_rows(results, earlier), keys=2)


def _with_broken(columns: Sequence[str], rows: Rows, results: Results) -> tuple[list[str], Rows]:
    """Return columns and rows of a table of agents, with how many missions of each broke if any did."""
    if not (number := Counter(result.agent for result in results if result.broke)):
        return list(columns), rows
    groups = _by_agent(results)
    broken = [f"{number[agent]} of {len(groups[agent])}" for agent, *_ in rows]
    name, *others = columns
    return [name, "broken", *others], [[row[0], cell, *row[1:]] for row, cell in zip(rows, broken, strict=True)]


def _print_failures(results: Results, console: Console) -> None:
    for result in results:
        if result.broke:
            failure = f"{result.kind}:{result.seed}:{result.agent} failed: {result.error}"
            console.print(printable(failure), markup=False)


def interval(value: Estimate, *, signed: bool = False) -> str:
    """Format a mean with its interval, if it has one."""
    if not value.number:
        return "-"
    sign = "+" if signed else ""
    bounds = "" if math.isnan(value.low) else f" [{value.low:{sign}.3f}, {value.high:{sign}.3f}]"
    return f"{value.mean:{sign}.3f}{bounds}"


def _print(console: Console, title: str, columns: Sequence[str], rows: Rows, keys: int = 1) -> None:
    """Print a table; one that is wider than the console as several, each with the first `keys` columns."""
    for number, chosen in enumerate(_groups([columns, *rows], keys, console.width)):
        table = Table(title=title if number == 0 else f"{title}, continued", title_justify="left")
        for index in chosen:
            table.add_column(Text(printable(columns[index])), overflow="fold")
        for row in rows:
            table.add_row(*(Text(printable(row[index])) for index in chosen))
        console.print(table)


def _groups(table: Sequence[Sequence[str]], keys: int, width: int) -> list[list[int]]:
    """Return the columns of each table: the first `keys`, and as many others as fit into `width`, at least one."""
    widths = [max(map(len, column)) + FRAME for column in zip(*table, strict=True)]
    groups: list[list[int]] = []
    room = 0
    for index in range(keys, len(widths)):
        if widths[index] > room:
            groups.append(list(range(keys)))
            room = width - sum(widths[:keys]) - 1
        groups[-1].append(index)
        room -= widths[index]
    return groups


def _by_agent(results: Results) -> dict[str, list[MissionResult]]:
    """Return the results of each agent, in the order in which the agents are declared."""
    groups = by(results, "agent")
    known = [name for name in ALL_NAMES if name in groups]
    return {agent: groups[agent] for agent in [*known, *(name for name in groups if name not in known)]}


def _success(results: Results) -> str:
    return _number(estimate([success_rate(result) for result in results]).mean, 2) if results else "-"


def _number(value: float | None, digits: int = 3, unit: str = "") -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.{digits}f}{unit}"


def _pair(values: Sequence[float | None], digits: int) -> str:
    return " / ".join(_number(value, digits) for value in values)
