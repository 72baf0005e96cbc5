"""Compute the figures of a sweep, each with its confidence interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .causes import ChoiceEvaluation
from .metrics import TargetResult
from .mission_result import MissionResult

RESAMPLES = 2000
CONFIDENCE = 0.95
SEED = 2017
"""Seed of the resampling: the same results give the same intervals."""

MIN_MISSIONS = 2
"""Fewer missions have no interval: all resamples of one mission are equal."""

REACHED_BY_S = (30.0, 60.0, 120.0, 300.0)
"""Mission times by which targets reached are counted."""

Pair = tuple[float, float]
"""One mission's contribution: a sum and the number of its terms."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean and its interval.

    Attributes:
        mean: The mean; NaN without values.
        low: Lower end of the interval; NaN for fewer than two missions with values.
        high: Upper end; likewise.
        number: Number of values.
    """

    mean: float
    low: float
    high: float
    number: int


def estimate(pairs: Sequence[Pair]) -> Estimate:
    """Estimate a mean, resampling whole missions because the values within a mission are not independent.

    Args:
        pairs: For each mission, the sum and the number of its values.
    """
    rows = np.array(pairs, dtype=np.float64).reshape(-1, 2)
    return bootstrap(rows, lambda sums: sums[..., 0] / sums[..., 1])


def bootstrap(
    rows: NDArray[np.float64],
    statistic: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    resamples: int = RESAMPLES,
) -> Estimate:
    """Estimate a statistic, with an interval from missions drawn again and again.

    Args:
        rows: For each mission a row of what it adds to sums, the last of which is the number of values.
        statistic: Computes the statistic of each row of sums over missions.
        resamples: Number of resamples, at most `RESAMPLES`.
    """
    number = int(rows[:, -1].sum())
    if not number:
        return Estimate(float("nan"), float("nan"), float("nan"), 0)
    mean = float(statistic(np.array([column.sum() for column in rows.T])))
    if np.count_nonzero(rows[:, -1]) < MIN_MISSIONS:
        return Estimate(mean, float("nan"), float("nan"), number)
    sums = _bootstrap_counts(len(rows))[:resamples] @ rows
    tail = (1.0 - CONFIDENCE) / 2
    low, high = np.quantile(statistic(sums[sums[:, -1] > 0]), [tail, 1.0 - tail])
    return Estimate(mean, float(low), float(high), number)


def estimate_share(pairs: Sequence[Pair]) -> Estimate:
    """Estimate a share as `estimate` does, but one of all or none by Wilson's interval over missions.

    All resamples of such missions are the same, so the bootstrap would call the share certain.
    """
    found = estimate(pairs)
    missions = sum(number > 0 for _, number in pairs)
    if found.mean in (0.0, 1.0) and missions >= MIN_MISSIONS:
        low, high = wilson(found.mean * missions, missions)
        return Estimate(found.mean, low, high, found.number)
    return found


def wilson(reached: float, number: float) -> tuple[float, float]:
    """Return the Wilson interval of a share.

    Args:
        reached: How many succeeded.
        number: How many there were; at least one.
    """
    z = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    share, spread = reached / number, z * z / number
    half = z * math.sqrt((share * (1 - share) + spread / 4) / number)
    middle = share + spread / 2
    # rounding must not move an end past the share: for all or none of them they are equal
    return min(share, max(0.0, (middle - half) / (1 + spread))), max(share, min(1.0, (middle + half) / (1 + spread)))


@lru_cache(maxsize=8)
def _bootstrap_counts(number: int) -> NDArray[np.uint16]:
    """Return how often each resample has each mission: one row for each resample."""
    draws = np.random.default_rng(SEED).integers(0, number, (RESAMPLES, number))
    return np.array([np.bincount(each, minlength=number) for each in draws], dtype=np.uint16)


def over_targets(value: Callable[[TargetResult], float]) -> Callable[[MissionResult], Pair]:
    """Return a function that collects a figure of each existing target; of a mission that broke it is 0."""
    return lambda result: (
        (0.0, float(result.unreached)) if result.broke else _pair([float(value(target)) for target in result.existing])
    )


def over_missions(value: Callable[[MissionResult], float]) -> Callable[[MissionResult], Pair]:
    """Return a function that collects a figure of each mission that did not break."""
    return lambda result: _pair([] if result.broke else [float(value(result))])


def over_choices(value: Callable[[ChoiceEvaluation], float | None]) -> Callable[[MissionResult], Pair]:
    """Return a function that collects a figure of each choice that has it."""
    return lambda result: _pair([float(each) for choice in result.choices if (each := value(choice)) is not None])


def _pair(values: Sequence[float]) -> Pair:
    return float(sum(values)), float(len(values))


def stops(result: MissionResult) -> Pair:
    """Count the wrong stops of a mission, and all."""
    wrong = sum(target.wrong_stops for target in result.targets)
    return float(wrong), float(wrong + sum(target.success for target in result.targets))


success_rate = over_targets(lambda target: target.success)
"""Counts the existing targets, and those reached."""


def success_by(time_s: float) -> Callable[[MissionResult], Pair]:
    """Return a function that counts the existing targets, and those reached by a mission time."""
    return over_targets(lambda target: target.time_s is not None and target.time_s <= time_s)


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure of an agent.

    Attributes:
        name: Its name among the figures of a summary; empty if it is not one of them.
        label: Its name in tables, and among the headline figures of a summary.
        pair: Returns a mission's contribution.
        share: Whether it is a share of targets, missions, stops or choices, not a mean.
        headline: Whether it is a headline figure.
        digits: Decimals in tables without intervals.
    """

    name: str
    label: str
    pair: Callable[[MissionResult], Pair]
    share: bool = False
    headline: bool = False
    digits: int = 3


TABLE = (
    Figure("success", "success", success_rate, share=True, headline=True),
    *(Figure("", f"by {time_s:.0f} s", success_by(time_s), share=True, headline=True) for time_s in REACHED_BY_S[1:]),
    Figure("spl", "SPL", over_targets(lambda target: target.spl), headline=True),
    Figure("soft_spl", "SoftSPL", over_targets(lambda target: target.soft_spl)),
    Figure("sct", "SCT", over_targets(lambda target: target.sct), headline=True),
    Figure("all_targets", "all targets", lambda result: (float(result.success), 1.0), share=True),
    Figure("contacts", "contacts", over_missions(lambda result: result.contacts), headline=True, digits=2),
    Figure("contact_free", "contact-free", over_missions(lambda result: result.contacts == 0), share=True, digits=2),
    Figure("wrong_stops", "wrong stops", stops, share=True),
    Figure("", "wrong stops", over_missions(lambda result: stops(result)[0]), headline=True),
    Figure("duration_s", "mission s", over_missions(lambda result: result.duration_s), digits=0),
    Figure("", "longest run", over_missions(lambda result: result.longest_run), headline=True),
    Figure("fitting_choices", "fitting choices", over_choices(lambda choice: choice.fits), share=True, digits=2),
    Figure("regret_s", "regret s", over_choices(lambda choice: choice.regret_s), digits=1),
)
"""All figures of agents; see docs/evaluation.md."""
FIGURES = {figure.name: figure for figure in TABLE if figure.name}
"""Those among the figures of a summary, by name."""
HEADLINE = {figure.label: figure for figure in TABLE if figure.headline}
"""The headline figures, by label."""
PAIRED = {figure.label: figure for figure in TABLE if figure.headline or figure.name == "duration_s"}
"""The figures whose differences on the same scenarios are estimated, by label."""


def figures(results: Sequence[MissionResult], table: Mapping[str, Figure] = FIGURES) -> dict[str, Estimate]:
    """Estimate figures from some results; the keys are those of the table."""
    return {
        key: (estimate_share if figure.share else estimate)([figure.pair(result) for result in results])
        for key, figure in table.items()
    }


def percentiles(values: Sequence[float], shares: Sequence[float] = (50, 90)) -> list[float | None]:
    """Return percentiles of some values; None without values."""
    return [float(np.percentile(values, share)) if values else None for share in shares]


def times_to_goal_s(results: Sequence[MissionResult]) -> list[float]:
    """Return the time spent on each target that was reached."""
    return [target.pursuit_s for result in results for target in result.targets if target.success]


def reached_by(results: Sequence[MissionResult], times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of the existing targets that had been reached by each of some mission times."""
    targets = [target for result in results for target in result.existing]
    reached = np.sort([target.time_s for target in targets if target.time_s is not None])
    number = len(targets) + sum(result.unreached for result in results if result.broke)
    return np.searchsorted(reached, times_s, side="right") / max(1, number)


def recognition_s(results: Sequence[MissionResult]) -> list[float]:
    """Return the seconds from each disturbance to the choice that followed."""
    return [delay for result in results for delay in result.recognition_s]


def given_up_s(results: Sequence[MissionResult]) -> list[float]:
    """Return the mission times at which absent targets were given up."""
    return [
        target.given_up_s
        for result in results
        for target in result.targets
        if not target.reachable and target.given_up_s is not None
    ]


def longest_run(results: Sequence[MissionResult]) -> int:
    """Return the longest run of recoveries for one target at one place after the same kind of failure."""
    return max((result.longest_run for result in results), default=0)


def soonest_s(results: Sequence[MissionResult]) -> float | None:
    """Return the shortest time between two decisions at one place."""
    return min((each for result in results if (each := result.soonest_s) is not None), default=None)


def by(results: Sequence[MissionResult], field: str) -> dict[str, list[MissionResult]]:
    """Group results by a field that is a text, in the order of first appearance."""
    groups: dict[str, list[MissionResult]] = {}
    for result in results:
        groups.setdefault(getattr(result, field), []).append(result)
    return groups


def aggregate(results: Sequence[MissionResult], eval_s: float) -> dict[str, Any]:
    """Summarise an agent in the format of LeRobot's evaluation, with our figures added.

    Args:
        results: The agent's results.
        eval_s: Wall time of the whole sweep.

    Returns:
        Values for JSON; a figure without values is None.
    """
    number = max(1, len(results))
    return {
        "avg_sum_reward": sum(result.sum_reward for result in results) / number,
        "avg_max_reward": sum(result.max_reward for result in results) / number,
        "pc_success": 100.0 * sum(result.success for result in results) / number,
        "eval_s": eval_s,
        "eval_ep_s": eval_s / number,
        "n_episodes": len(results),
        "n_broken": sum(result.broke for result in results),
        "figures": {
            name: finite([each.mean, each.low, each.high, each.number]) for name, each in figures(results).items()
        },
        "time_to_goal_s": percentiles(times_to_goal_s(results)),
        "recognition_s": percentiles(recognition_s(results)),
        "given_up_s": percentiles(given_up_s(results)),
        "longest_run": longest_run(results),
        "soonest_s": soonest_s(results),
    }


def finite(value: Any) -> Any:  # noqa: ANN401 - any plain value
    """Replace numbers that JSON lacks; a figure without values is null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    return [finite(each) for each in value] if isinstance(value, list) else value
