"""Regret of decisions, without the bias that comes from choosing the best of noisy means.

The cheapest of several noisy means is too cheap ("winner's curse"). So one half of the futures selects the best
candidate, and the other half gives the costs of it and of the chosen one; then the halves are swapped, and the two
differences are averaged. Even futures are one half, odd ones the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .summary import Estimate, estimate

EQUIVALENT_S = 3.0
"""A choice within this of the best is as good."""


@dataclass(frozen=True, slots=True)
class Regret:
    """The cost of a decision beyond the best candidate.

    Attributes:
        seconds: Corrected for the bias; below 0 if the best one in one half was worse in the other.
        biased_s: The difference of the means to the lowest mean: never below 0, and too large.
        best: Number of the candidate with the lowest mean.
        interval: The mean difference to the best candidate over the futures, with its bootstrap interval.
    """

    seconds: float
    biased_s: float
    best: int
    interval: Estimate


def regret(costs_s: NDArray[np.float64]) -> Regret:
    """Compute the regret of candidate 0.

    Args:
        costs_s: One row for each candidate, one column for each future, at least two of these.
    """
    means = costs_s.mean(axis=1)
    best = int(np.argmin(means))
    halves = costs_s[:, ::2], costs_s[:, 1::2]
    corrected = [
        float(held_out[0].mean() - held_out[int(np.argmin(choosing.mean(axis=1)))].mean())
        for choosing, held_out in (halves, halves[::-1])
    ]
    more = costs_s[0] - costs_s[best]
    return Regret(sum(corrected) / 2, float(means[0] - means[best]), best, estimate([(each, 1.0) for each in more]))
