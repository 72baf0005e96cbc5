"""The headline figures of a sweep: those of each agent, and differences between agents, with intervals.

Differences are paired by scenario and resampled by scenario. Definitions: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .mission_result import MissionResult
from .summary import Estimate, Pair, by, estimate, estimates, over_missions, over_targets, success_rate

TOGETHER = "together"
"""Stands for all classes."""
REACHED_BY_S = (30.0, 60.0, 120.0, 300.0)


def success_by(time_s: float) -> Callable[[MissionResult], Pair]:
    """Return a function that counts the targets reached by a mission time, as `success_rate` counts those reached."""

    def count(result: MissionResult) -> Pair:
        _, number = success_rate(result)
        return float(sum(target.time_s is not None and target.time_s <= time_s for target in result.targets)), number

    return count


HEADLINE: dict[str, Callable[[MissionResult], Pair]] = {
    "success": success_rate,
    **{f"by {time_s:.0f} s": success_by(time_s) for time_s in REACHED_BY_S if time_s > REACHED_BY_S[0]},
    "SPL": over_targets(lambda target: target.spl),
    "SCT": over_targets(lambda target: target.sct),
    "contacts": over_missions(lambda result: result.contacts),
    "wrong stops": over_missions(lambda result: sum(target.wrong_stops for target in result.targets)),
    "longest run": over_missions(lambda result: result.longest_run),
}
"""Figures by name. The first six are means over the existing targets, the others over the missions."""
SHARES = tuple(name for name in HEADLINE if name == "success" or name.startswith("by "))
"""Those that are shares of the existing targets."""


def headline(results: Sequence[MissionResult]) -> dict[str, Estimate]:
    """Estimate the headline figures of some results."""
    return estimates(results, HEADLINE, SHARES)


def beyond(ours: Sequence[MissionResult], theirs: Sequence[MissionResult]) -> dict[str, Estimate]:
    """Estimate by how much each headline figure of one agent exceeds another's on the same scenarios."""
    return {name: difference(ours, theirs, pair) for name, pair in HEADLINE.items()}


def against(
    results: Sequence[MissionResult], earlier: Sequence[MissionResult]
) -> dict[str, dict[str, dict[str, Estimate]]]:
    """Estimate by how much each agent's headline figures exceed its own in another sweep on the same scenarios.

    Returns:
        By agent, then by class, and for all `TOGETHER`; without agents and classes that only one of the sweeps has.
    """
    before, found = by(earlier, "agent"), {}
    for agent, group in by(results, "agent").items():
        then = by(before.get(agent, []), "kind")
        parts = {kind: part for kind, part in by(group, "kind").items() if kind in then}
        if parts:
            differences = {kind: beyond(part, then[kind]) for kind, part in parts.items()}
            found[agent] = {**differences, TOGETHER: beyond(group, before[agent])}
    return found


def difference(
    ours: Sequence[MissionResult], theirs: Sequence[MissionResult], pair: Callable[[MissionResult], Pair] = success_rate
) -> Estimate:
    """Estimate by how much a figure of one agent exceeds another's on the same scenarios, resampled by scenario.

    A mission that broke counts with the number of targets of the other agent's mission, none of them reached; figures
    of whole missions leave its scenario out.
    """
    other = {(result.kind, result.seed): result for result in theirs}
    both = [(result, other[key]) for result in ours if (key := (result.kind, result.seed)) in other]
    return estimate([_more(*results, pair) for results in both])


def _more(result: MissionResult, other: MissionResult, pair: Callable[[MissionResult], Pair]) -> Pair:
    """Return a difference of sums, and the number of its terms."""
    (ours, number), (theirs, same) = pair(result), pair(other)
    if pair in _OF_MISSIONS and not (number and same):
        return 0.0, 0.0
    return ours - theirs, same if result.broke else number


_OF_MISSIONS = {HEADLINE[name] for name in ("contacts", "wrong stops", "longest run")}
