"""The headline figures of a sweep: those of each agent, and differences between agents, with intervals.

Differences are paired by scenario and resampled by scenario. Definitions: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from behaviors.executive import Ending

from .performance import Line
from .summary import Estimate, Pair, estimate, estimates, over_missions, over_targets, success_rate

REACHED_BY_S = (30.0, 60.0, 120.0, 300.0)


def success_by(time_s: float) -> Callable[[Line], Pair]:
    """Return a function that counts the targets reached by a mission time, as `success_rate` counts those reached."""

    def count(line: Line) -> Pair:
        _, number = success_rate(line)
        return float(sum(target["success"] and target["time_s"] <= time_s for target in line["targets"])), number

    return count


HEADLINE: dict[str, Callable[[Line], Pair]] = {
    "success": success_rate,
    **{f"by {time_s:.0f} s": success_by(time_s) for time_s in REACHED_BY_S if time_s > REACHED_BY_S[0]},
    "SPL": over_targets("spl"),
    "SCT": over_targets("sct"),
    "contacts": over_missions(lambda line: line["contacts"]),
    "wrong stops": over_missions(lambda line: sum(target["wrong_stops"] for target in line["targets"])),
    "longest run": over_missions(lambda line: line.get("longest_run", 0)),
}
"""Figures by name. The first six are means over the existing targets, the others over the missions."""
SHARES = tuple(name for name in HEADLINE if name == "success" or name.startswith("by "))
"""Those that are shares of the existing targets."""


def headline(lines: Sequence[Line]) -> dict[str, Estimate]:
    """Estimate the headline figures of some lines."""
    return estimates(lines, HEADLINE, SHARES)


def beyond(ours: Sequence[Line], theirs: Sequence[Line]) -> dict[str, Estimate]:
    """Estimate by how much each headline figure of one agent exceeds another's on the same scenarios."""
    return {name: difference(ours, theirs, pair) for name, pair in HEADLINE.items()}


def difference(ours: Sequence[Line], theirs: Sequence[Line], pair: Callable[[Line], Pair] = success_rate) -> Estimate:
    """Estimate by how much a figure of one agent exceeds another's on the same scenarios, resampled by scenario.

    A mission that broke counts with the number of targets of the other agent's mission, none of them reached; figures
    of whole missions leave its scenario out.
    """
    other = {(line["class"], line["seed"]): line for line in theirs}
    both = [(line, other[key]) for line in ours if (key := (line["class"], line["seed"])) in other]
    return estimate([_more(*lines, pair) for lines in both])


def _more(line: Line, other: Line, pair: Callable[[Line], Pair]) -> Pair:
    """Return a difference of sums, and the number of its terms."""
    (ours, number), (theirs, same) = pair(line), pair(other)
    if pair in _OF_MISSIONS and not (number and same):
        return 0.0, 0.0
    return ours - theirs, same if line["ending"] == Ending.BROKEN else number


_OF_MISSIONS = {HEADLINE[name] for name in ("contacts", "wrong stops", "longest run")}
