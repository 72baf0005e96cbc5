"""Calibration of the chances that profiles give their choices: reliability, and the expected calibration error.

Definitions: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .performance import Line
from .summary import CONFIDENCE, LEAST_MISSIONS, RESAMPLES, SEED, Estimate

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
    places = np.minimum((values[:, 0] * BINS).astype(int), BINS - 1)
    return [
        Bin(i / BINS, (i + 1) / BINS, len(part), float(part[:, 0].mean()), float(part[:, 1].mean()))
        for i in range(BINS)
        if len(part := values[places == i])
    ]


def calibration_error(lines: Sequence[Line]) -> Estimate:
    """Return the expected calibration error with its bootstrap interval, whole missions resampled."""
    missions = [part for line in lines if len(part := pairs([line]))]
    if not missions:
        return Estimate(float("nan"), float("nan"), float("nan"), 0)
    whole = np.concatenate(missions)
    if len(missions) < LEAST_MISSIONS:
        return Estimate(_error(whole), float("nan"), float("nan"), len(whole))
    draws = np.random.default_rng(SEED).integers(0, len(missions), (RESAMPLES // 4, len(missions)))
    errors = [_error(np.concatenate([missions[i] for i in draw])) for draw in draws]
    tail = (1.0 - CONFIDENCE) / 2
    low, high = np.quantile(errors, [tail, 1.0 - tail])
    return Estimate(_error(whole), float(low), float(high), len(whole))


def error_of_true_chances(lines: Sequence[Line]) -> float:
    """Return the mean calibration error of chances that are true, of these numbers and sizes; NaN without any."""
    chances = pairs(lines)[:, 0]
    if not len(chances):
        return float("nan")
    draws = np.random.default_rng(SEED).random((TRUE_DRAWS, len(chances)))
    return float(np.mean([_error(np.stack([chances, draw < chances], axis=1)) for draw in draws]))


def _error(values: NDArray[np.float64]) -> float:
    """Return the mean calibration error of the bins, weighted by their predictions."""
    return sum(each.number * abs(each.predicted - each.came_true) for each in reliability(values)) / len(values)


def pairs(lines: Sequence[Line], choice: str = "") -> NDArray[np.float64]:
    """Return the chance, and whether it succeeded, of all predictions or those for one choice."""
    found = [
        (each["chance"], float(each["came_true"]))
        for line in lines
        for each in line.get("chances", [])
        if choice in ("", each["choice"])
    ]
    return np.array(found, dtype=np.float64).reshape(-1, 2)
