"""Calibration of the chances that profiles give their choices: reliability, and the expected calibration error.

Definitions: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .mission_result import MissionResult
from .summary import RESAMPLES, SEED, Estimate, bootstrap

BINS = 10
"""Bins of equal width, from 0 to 1."""
TRUE_DRAWS = 200
"""The error of true chances is the mean of this many draws of their outcomes."""


@dataclass(frozen=True, slots=True)
class Bin:
    """Predictions of about the same chance.

    Attributes:
        low: Smallest chance of the bin.
        high: Largest one.
        number: Number of predictions.
        predicted: Their mean chance.
        came_true: Share that succeeded.
    """

    low: float
    high: float
    number: int
    predicted: float
    came_true: float


def reliability(values: NDArray[np.float64]) -> list[Bin]:
    """Return the bins with predictions; the columns are the chance and whether it succeeded."""
    places = _bins(values)
    return [
        Bin(i / BINS, (i + 1) / BINS, len(part), float(part[:, 0].mean()), float(part[:, 1].mean()))
        for i in range(BINS)
        if len(part := values[places == i])
    ]


def calibration_error(results: Sequence[MissionResult]) -> Estimate:
    """Return the expected calibration error with its bootstrap interval, whole missions resampled."""
    rows = np.array([_sums(part) for result in results if len(part := pairs([result]))]).reshape(-1, BINS + 1)
    return bootstrap(rows, _errors, RESAMPLES // 4)


def error_of_true_chances(results: Sequence[MissionResult]) -> float:
    """Return the mean calibration error of chances that are true, of these numbers and sizes; NaN without any."""
    chances = pairs(results)[:, 0]
    if not len(chances):
        return float("nan")
    draws = np.random.default_rng(SEED).random((TRUE_DRAWS, len(chances)))
    return float(np.mean([_errors(_sums(np.stack([chances, draw < chances], axis=1))) for draw in draws]))


def _bins(values: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.minimum((values[:, 0] * BINS).astype(np.int64), BINS - 1)


def _sums(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by how much the chances of each bin exceed its successes, and last the number of predictions."""
    return np.append(np.bincount(_bins(values), values[:, 0] - values[:, 1], BINS), len(values))


def _errors(sums: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the calibration error of each row of `_sums`: that of the bins, weighted by their predictions."""
    return np.asarray(np.abs(sums[..., :BINS]).sum(axis=-1) / sums[..., BINS])


def pairs(results: Sequence[MissionResult], choice: str = "") -> NDArray[np.float64]:
    """Return the chance, and whether it succeeded, of all predictions or those for one choice."""
    found = [
        (each.chance, float(each.came_true))
        for result in results
        for each in result.chances
        if choice in ("", each.choice)
    ]
    return np.array(found, dtype=np.float64).reshape(-1, 2)
