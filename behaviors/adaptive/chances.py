"""How often choices succeed: counts from earlier missions, and the chance of a candidate that follows from them.

Counts are kept for each situation: a choice, the chance that the world model gives it, the failure's name, and how many
choices in a row led to no approach. The chance in a rare situation is shrunk towards that in the more common situation
that it is part of.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import resources

import numpy as np

from behaviors.events import Reason
from behaviors.evidence import Evidence
from behaviors.recoveries import RECOVERIES, Recovery
from input_files.json_text import parse_object

ESTIMATES = (0.01, 0.05, 0.15, 0.5)
"""The chances by the world model that are distinguished; others are interpolated, and below these in proportion."""
ATTEMPT_BUCKETS = (0, 1, 2, 4, 8)
"""Buckets for the number of choices in a row without an approach; each begins at this number."""
PRIOR = 4.0
"""The more common situation counts as this many outcomes: by log loss on seeds that were left out."""
OWN_PRIOR = 10.0
"""The counts that come with nxtdrive count as this many outcomes beside the user's own."""

Counts = Mapping[str, Sequence[int]]
"""How often a choice succeeded, and how often not, by situation."""


class Chances:
    """Success rates of candidates in earlier missions.

    Args:
        counts: Outcomes of many missions.
        own: Outcomes of the user's own missions.
    """

    def __init__(self, counts: Counts, own: Counts | None = None) -> None:
        self._sums: defaultdict[str, tuple[int, int]] = defaultdict(lambda: (0, 0))
        for situation, (successes, failures) in counts.items():
            for part in _parts(situation):
                known = self._sums[part]
                self._sums[part] = known[0] + successes, known[1] + failures
        self._own = own or {}

    def of(self, choice: Recovery, evidence: Evidence, estimate: float, best: float | None = None) -> tuple[float, str]:
        """Return the chance that a choice succeeds, and the situation under which its outcome counts.

        Args:
            choice: What would be done.
            evidence: What is known.
            estimate: Its chance by the world model.
            best: The highest estimate of the candidates of its kind, whose chances keep their ratio; None for its own.
        """
        situations = [_situation(choice, each, evidence) for each in ESTIMATES]
        chances = [self._chance(*each) for each in zip(situations, ESTIMATES, strict=True)]
        nearest = min(range(len(ESTIMATES)), key=lambda i: abs(math.log(max(estimate, 1e-9) / ESTIMATES[i])))
        best = max(estimate, best or 0.0)
        share = estimate / best if best > 0 else 0.0
        return share * float(np.interp(best, (0.0, *ESTIMATES), (0.0, *chances))), situations[nearest]

    def _chance(self, situation: str, chance: float) -> float:
        """Return the chance in a situation; `chance` is that where nothing was counted."""
        for part in _parts(situation):
            chance = _posterior(self._sums.get(part, (0, 0)), chance, PRIOR)
        return _posterior(self._own.get(situation, (0, 0)), chance, OWN_PRIOR)


@cache
def shipped() -> Counts:
    """Return the counts that come with nxtdrive; docs/adaptive.md says how they were made."""
    text = resources.files(__package__).joinpath("chances.json").read_text(encoding="utf-8")
    counts: Counts = parse_object(text)["counts"]
    return counts


def _situation(choice: Recovery, estimate: float, evidence: Evidence) -> str:
    tries = max(each for each in ATTEMPT_BUCKETS if each <= evidence.tries)
    return f"{choice.name}/{estimate}/{evidence.reason}/{tries}"


def is_situation(text: str) -> bool:
    """Return whether outcomes are counted under this name."""
    choice, *numbers = text.split("/")
    if choice not in RECOVERIES or len(numbers) != 3:
        return False
    estimate, reason, tries = numbers
    return estimate in set(map(str, ESTIMATES)) and reason in set(Reason) and tries in set(map(str, ATTEMPT_BUCKETS))


def _parts(situation: str) -> Iterator[str]:
    """Yield the situations that it is part of, from the choice with its estimate on, and itself."""
    names = situation.split("/")
    for number in range(2, len(names) + 1):
        yield "/".join(names[:number])


def _posterior(counts: Sequence[int], mean: float, weight: float) -> float:
    """Return the mean of a Beta distribution after these outcomes, with a prior of this mean and weight."""
    successes, failures = counts
    return (successes + weight * mean) / (successes + failures + weight)
