"""The result of what-if for a mission: what each candidate of its decisions would have cost."""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import zip_longest
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import number_of
from nxtdrive.recording.decision_costs import CandidateCost, DecisionCosts, decision_costs
from nxtdrive.recording.output_file import locked, replace_file
from nxtdrive.recording.run_folder import WHAT_IF

from .regret import EQUIVALENT_S, regret
from .runner import Workers
from .summary import Estimate, estimate
from .what_if import EpisodeOutcome, Futures, all_costs, run_with_branch
from .what_if_file import ExaminedMission, Key
from .what_if_source import RebuiltRun, RecordedRun, Source

Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Request:
    """Which decisions of a mission are examined, and how closely.

    Attributes:
        decision: Only this one, counted from 1; None for all.
        sample: Only this many, chosen at random, the same ones each time; None for all.
        futures: Futures tried for each candidate.
        redraw_unseen: Whether the targets that have not been in view hang elsewhere in each future.
    """

    decision: int | None
    sample: int | None
    futures: int
    redraw_unseen: bool = False

    def key(self, name: str) -> Key:
        """Identify the result of a mission, as `ExaminedMission.key` does."""
        return name, self.decision, self.sample, self.futures, self.redraw_unseen

    def answered(self, name: str, decisions: list[DecisionCosts]) -> ExaminedMission:
        """Return the result of a mission."""
        return ExaminedMission(run=name, **asdict(self), decisions=decisions)

    def numbers(self, made: int) -> list[int]:
        """Return the numbers of the decisions to examine, from 0, of as many as the mission made.

        Raises:
            ConfigError: There is no such decision.
        """
        numbers = list(range(made))
        if self.decision is not None:
            if self.decision > made:
                raise ConfigError(f"there is no decision {self.decision}: the mission has {made}.")
            numbers = [self.decision - 1]
        if self.sample is not None and self.sample < len(numbers):
            numbers = sorted(Random("what if").sample(numbers, self.sample))
        return numbers


def examine(name: str, source: Source, request: Request, workers: Workers, tell: Tell) -> Iterator[DecisionCosts]:
    """Run a mission and the branches of its decisions; yield each decision with the cost of its candidates.

    Args:
        name: As the user named the mission.
        source: The mission.
        request: Which decisions.
        workers: Run the branches.
        tell: Called with a sentence at each step.

    Raises:
        ConfigError: The run cannot be repeated, or has no such decision.
    """
    if isinstance(source, RebuiltRun):
        world = source.scenario.world
        tell(
            f"{name} is a run of a real robot. It is repeated in a room made from its map, with {len(world.boxes)} "
            f"obstacles and {len(world.pictures)} targets; the robot may decide differently there."
        )
    if isinstance(source, RecordedRun):
        request.numbers(len(source.choices))
    tell(f"{name}: repeating the mission, to find its decisions")
    begun_s = time.perf_counter()
    base = run_with_branch(source, tell=lambda each: tell(f"{name}: a decision at {each.time_s:.0f} s"))
    took_s = time.perf_counter() - begun_s
    if isinstance(source, RecordedRun):
        _check_repeated(name, source.choices, base)
    wanted = request.numbers(len(base.decisions))
    branches = request.futures * sum(len(base.decisions[at].candidates) for at in wanted)
    tell(f"{name}: {number_of(branches, 'mission')} to run; this one took {took_s:.1f} s")
    futures = Futures(request.futures, request.redraw_unseen)
    for done, (at, costs_s) in enumerate(all_costs(source, base, futures, wanted, workers), 1):
        tell(f"{name}: decision {at + 1} is done, {done} of {len(wanted)}")
        yield _decision_costs(at, base, costs_s)


def keep(folder: Path, name: str, decision: DecisionCosts) -> None:
    """Add a decision to the result in its run folder.

    Raises:
        OSError: It cannot be written.
    """
    with locked(folder):  # other commands may add theirs at the same time
        known = {**decision_costs(folder), decision.decision: decision}
        content = {"run": name, "decisions": [known[at].plain() for at in sorted(known)]}
        replace_file(folder / WHAT_IF, (json.dumps(content, indent=2) + "\n").encode())


def figures_by_reason(results: Sequence[ExaminedMission]) -> dict[str, dict[str, Any]]:
    """Return the number of decisions after each failure, by its name, and their figures as `mean_figures` does."""
    counts = Counter(each.reason for result in results for each in result.decisions if each.has_alternative)
    return {reason: {"decisions": number, **mean_figures(results, reason)} for reason, number in counts.most_common()}


def mean_figures(results: Sequence[ExaminedMission], reason: str | None = None) -> dict[str, list[float]]:
    """Return the mean regret and the shares of choices nearly the best and certainly not, with intervals, if any.

    What had no alternative counts for none of them.

    Args:
        results: The missions.
        reason: Only decisions after this failure; None for all.
    """
    decisions = [
        [each for each in result.decisions if each.has_alternative and reason in (None, each.reason)]
        for result in results
    ]
    if not any(decisions):
        return {}
    values: dict[str, Callable[[DecisionCosts], float]] = {
        "regret_s": lambda each: each.regret_s,
        "nearly_best": lambda each: each.regret_s <= EQUIVALENT_S,
        "certainly_worse": lambda each: each.beyond_best_s[1] > EQUIVALENT_S,
    }
    # decisions of one mission are alike: whole missions are resampled
    figures = {name: estimate([(sum(map(of, made)), len(made)) for made in decisions]) for name, of in values.items()}
    return {
        name: [round(value, 3) for value in (each.mean, each.low, each.high) if math.isfinite(value)]
        for name, each in figures.items()
    }


def _check_repeated(name: str, recorded: Sequence[tuple[float, str]], base: EpisodeOutcome) -> None:
    """Raise a `ConfigError` that names the first decision in which a mission differs from its record."""
    choices = [(each.time_s, each.chose) for each in base.decisions]
    for number, (was, now) in enumerate(zip_longest(recorded, choices), 1):
        if was != now:
            then = f"its decision {number} is {was[1]} at {was[0]:.3f} s" if was else f"it has no decision {number}"
            instead = f"{now[1]} at {now[0]:.3f} s" if now else "the end"
            raise ConfigError(
                f"{name} cannot be repeated: {then}, and the same mission now leads to {instead}.",
                remedy="It was started on the page of `nxtdrive web`, made with another version of nxtdrive or of its "
                "world file, or a person or another program intervened.",
            )


def _decision_costs(at: int, base: EpisodeOutcome, costs_s: list[list[float]]) -> DecisionCosts:
    """Return what each candidate of a decision would have cost."""
    made, found = base.decisions[at], regret(np.array(costs_s))
    means = [estimate([(cost_s, 1.0) for cost_s in each]) for each in costs_s]
    return DecisionCosts(
        decision=at + 1,
        time_s=round(made.time_s, 3),
        target=made.target,
        reason=made.reason,
        futures=len(costs_s[0]),
        regret_s=round(found.seconds, 2),
        biased_regret_s=round(found.biased_s, 2),
        beyond_best_s=_rounded(found.interval),
        candidates=[
            CandidateCost(does=words, chosen=number == 0, best=number == found.best, cost_s=_rounded(mean))
            for number, (words, mean) in enumerate(zip(made.candidates, means, strict=True))
        ],
    )


def _rounded(value: Estimate) -> list[float]:
    return [round(each, 2) for each in (value.mean, value.low, value.high)]
