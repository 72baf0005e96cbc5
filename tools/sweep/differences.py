"""Differences between the figures of agents, with intervals, paired and resampled by scenario.

Definitions: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Sequence

from .mission_result import MissionResult
from .summary import FIGURES, PAIRED, Estimate, Figure, Pair, by, estimate

TOGETHER = "together"
"""Stands for all classes."""


def beyond(ours: Sequence[MissionResult], theirs: Sequence[MissionResult]) -> dict[str, Estimate]:
    """Estimate by how much each of `PAIRED` of one agent exceeds another's on the same scenarios."""
    return {label: difference(ours, theirs, figure) for label, figure in PAIRED.items()}


def against(
    results: Sequence[MissionResult], earlier: Sequence[MissionResult]
) -> dict[str, dict[str, dict[str, Estimate]]]:
    """Estimate by how much each agent's figures exceed its own in another sweep on the same scenarios.

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
    ours: Sequence[MissionResult], theirs: Sequence[MissionResult], figure: Figure = FIGURES["success"]
) -> Estimate:
    """Estimate by how much a figure of one agent exceeds another's on the same scenarios, resampled by scenario.

    A mission that broke counts with the number of targets of the other agent's mission, none of them reached; figures
    of whole missions leave its scenario out.
    """
    other = {(result.kind, result.seed): result for result in theirs}
    both = [(result, other[key]) for result in ours if (key := (result.kind, result.seed)) in other]
    return estimate([_more(*results, figure) for results in both])


def _more(result: MissionResult, other: MissionResult, figure: Figure) -> Pair:
    """Return a difference of sums, and the number of its terms."""
    (ours, number), (theirs, same) = figure.pair(result), figure.pair(other)
    if not (number and same):
        return 0.0, 0.0
    return ours - theirs, same if result.broke else number
