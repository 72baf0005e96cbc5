"""How long to wait for a blocker when there is a detour: a ski rental problem.

Waiting as long as the detour would take, and then taking it, never costs more than twice what it would cost with
foresight. Hypotheses about the blocker allow shorter waits on average; the bound is kept under each of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from behaviors.failures import Blocker

NEGLIGIBLE_CHANCE = 0.05
"""Less likely hypotheses do not count."""
COST_BOUND = 2.0
"""Under no hypothesis does waiting cost more than this many times what it would cost with foresight."""
LONGEST_S = 30.0
"""No single wait is longer; afterwards more is known."""
PASSING_S = 4.0
"""Mean stay of a person who walks through."""
LINGERING_S = 20.0
"""Mean stay of a person who stops."""
BESIDE_CHANCES = (0.02, 0.02, 0.96)
"""Probabilities that a blocker past which the target is seen is a person who walks through, one who stops, or
furniture. These and the next two are estimates, not counts."""
MOVING_CHANCES = (0.45, 0.45, 0.10)
"""The same of a blocker that was seen to move."""
HIDING_CHANCES = (0.25, 0.30, 0.45)
"""The same of a blocker that hides the target and was not."""
WAITS = tuple(0.125 * i for i in range(25))
"""Waits that are considered, as shares of what the detour costs; 1 is among them, which keeps the bound."""


@dataclass(frozen=True, slots=True)
class BlockerHypothesis:
    """A hypothesis about what a blocker is.

    Attributes:
        stays_s: Mean time it stays; infinite for furniture.
        weight: Probability of this hypothesis, 0..1.
    """

    stays_s: float
    weight: float

    def survival(self, time_s: float) -> float:
        """Return the probability that it is still there after a time."""
        return 1.0 if math.isinf(self.stays_s) else math.exp(-time_s / self.stays_s)

    def cost_s(self, wait_s: float, round_s: float) -> float:
        """Return the mean cost of waiting up to `wait_s` and then going round."""
        return self.foresight_s(wait_s) + self.survival(wait_s) * round_s

    def foresight_s(self, time_s: float) -> float:
        """Return the mean stay, cut off at `time_s`: the cost with foresight where a detour takes that long."""
        return time_s if math.isinf(self.stays_s) else self.stays_s * (1.0 - math.exp(-time_s / self.stays_s))


def hypotheses(blocker: Blocker) -> tuple[BlockerHypothesis, ...]:
    """Return what it may be: what moves is a person; what does not hide the target, or stays long, is furniture."""
    weights = MOVING_CHANCES if blocker.moving else HIDING_CHANCES if blocker.hides else BESIDE_CHANCES
    stays_s = PASSING_S, LINGERING_S, math.inf
    prior = [BlockerHypothesis(*each) for each in zip(stays_s, weights, strict=True)]
    left = [each.weight * each.survival(blocker.age_s) for each in prior]
    return tuple(BlockerHypothesis(each.stays_s, weight / sum(left)) for each, weight in zip(prior, left, strict=True))


def cost_s(mixture: Sequence[BlockerHypothesis], wait_s: float, round_s: float) -> float:
    """Return the mean cost of waiting up to `wait_s` and then going round; without a detour, waiting once more."""
    if math.isinf(round_s):
        round_s = LONGEST_S
    return sum(each.weight * each.cost_s(wait_s, round_s) for each in mixture)


def best_wait_s(mixture: Sequence[BlockerHypothesis], round_s: float) -> float:
    """Return how long to wait before going round.

    Args:
        mixture: The hypotheses about what it may be.
        round_s: What going round costs; infinite without a detour.

    Returns:
        The wait, seconds, that costs least on average. Under each hypothesis that is not negligible the mean cost is at
        most twice that with foresight; where going round takes longer than the longest wait, at most 1 + `round_s` /
        `LONGEST_S` times.
    """
    if math.isinf(round_s):
        return LONGEST_S
    waits = [min(LONGEST_S, share * round_s) for share in WAITS]
    sound = [wait_s for wait_s in waits if all(_bounded(each, wait_s, round_s) for each in mixture)]
    return min(sound, key=lambda wait_s: cost_s(mixture, wait_s, round_s))


def _bounded(hypothesis: BlockerHypothesis, wait_s: float, round_s: float) -> bool:
    if hypothesis.weight < NEGLIGIBLE_CHANCE:
        return True
    bound = max(COST_BOUND, 1.0 + round_s / LONGEST_S)  # the cap on a single wait may cost more than twice
    return hypothesis.cost_s(wait_s, round_s) <= bound * hypothesis.foresight_s(round_s) + 1e-9
