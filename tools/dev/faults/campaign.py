"""Campaigns, and the distribution of their trials over processes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field


class GuaranteeViolated(Exception):
    """What a trial must not show; the text says what it showed."""


@dataclass(frozen=True)
class Violation:
    """A guarantee that was violated.

    Attributes:
        number: The trial's number; with the campaign's seed it reproduces the trial.
        text: What was guaranteed and what happened instead, with the bytes or the file that did it.
    """

    number: int
    text: str


@dataclass
class Tally:
    """The outcomes of some trials.

    Attributes:
        outcomes: How often each permitted outcome occurred, such as "resumed" or "refused with exit code 2".
        violations: Each violation.
        longest_s: Processor time of the longest trial, if the campaign measures it; equal trials may differ in it.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    violations: list[Violation] = field(default_factory=list)
    longest_s: float = field(default=0.0, compare=False)

    def add(self, other: Tally) -> None:
        """Add the results of other trials."""
        self.outcomes += other.outcomes
        self.violations += other.violations
        self.longest_s = max(self.longest_s, other.longest_s)


@dataclass(frozen=True)
class Campaign:
    """One guarantee, tested many times.

    Attributes:
        guarantee: What is guaranteed, one sentence.
        unit: What is counted, in the plural, such as "telegrams".
        count: The number of trials of a full campaign.
        batch: Trials that one call of `run` makes; trials of one batch may depend on those before them in it.
        run: Makes the trials of these numbers with this seed. It is called in other processes, so it is a function of
            a module, and equal arguments give equal tallies.
    """

    guarantee: str
    unit: str
    count: int
    batch: int
    run: Callable[[int, range], Tally]


def run_campaign(campaign: Campaign, seed: int, count: int, workers: int = 1) -> Iterator[tuple[int, Tally]]:
    """Make `count` trials; after each batch yield the number of trials made so far and the tally of all of them."""
    batches = [range(first, min(first + campaign.batch, count)) for first in range(0, count, campaign.batch)]
    total, made = Tally(), 0
    with ProcessPoolExecutor(workers) if workers > 1 else nullcontext() as pool:
        tallies = (pool.map if pool else map)(campaign.run, [seed] * len(batches), batches)
        for numbers, tally in zip(batches, tallies, strict=True):
            total.add(tally)
            made += len(numbers)
            yield made, total


def batch_of(campaign: Campaign, number: int) -> range:
    """Return the trials up to `number` in its batch: what has to be run again to reproduce it."""
    return range(number - number % campaign.batch, number + 1)
