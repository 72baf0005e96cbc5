"""The target queue: the ordered targets of a mission and their outcomes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum


class TargetOutcome(StrEnum):
    """The outcome of a target."""

    PENDING = "pending"
    REACHED = "reached"
    GIVEN_UP = "given_up"


@dataclass(slots=True)
class TargetProgress:
    """One target of the mission.

    Attributes:
        target: Its name.
        outcome: Its outcome so far.
        time_s: When that was decided, seconds of mission time; None while pending.
        attempts: Searches started for it, over all rounds.
        round: In which round it is, or was last, from 1; 0 before the first.
    """

    target: str
    outcome: TargetOutcome = TargetOutcome.PENDING
    time_s: float | None = None
    attempts: int = 0
    round: int = 0


class TargetQueue:
    """The targets in order; with more than one round, those not reached are tried again after the last.

    Args:
        targets: Names in order, at least one.
        rounds: Most rounds for one target.

    Attributes:
        first_of: Chooses which of these targets is next, where nothing else has; the first in order unless a profile
            sets another rule.
        due: Whether a target may come before its next round; none may unless a profile sets another rule.
    """

    def __init__(self, targets: Sequence[str], rounds: int = 1) -> None:
        self.targets = [TargetProgress(target) for target in targets]
        self.rounds = rounds
        self.first_of: Callable[[Sequence[str]], str] = lambda names: names[0]
        self.due: Callable[[str], bool] = lambda _: False
        self._begin(self.targets[0])

    @property
    def names(self) -> list[str]:
        """Names of all targets, each once."""
        return list(dict.fromkeys(progress.target for progress in self.targets))

    @property
    def target(self) -> str:
        """Name of the target being pursued."""
        return self.current.target

    @property
    def round(self) -> int:
        """The round of the current target, from 1."""
        return self.current.round

    @property
    def more_targets(self) -> bool:
        """Whether there is another target to pursue once the current one is decided."""
        return bool(self._waiting())

    @property
    def another_round(self) -> bool:
        """Whether the current target is tried again if it is left now."""
        return self.current.round < self.rounds

    @property
    def achieved(self) -> bool:
        """Whether every target has been reached."""
        return all(progress.outcome is TargetOutcome.REACHED for progress in self.targets)

    @property
    def outcomes(self) -> dict[str, TargetOutcome]:
        """The outcome of each target; one that is listed several times is reached if it was each time."""
        outcomes: dict[str, TargetOutcome] = {}
        for progress in self.targets:
            if outcomes.get(progress.target, TargetOutcome.REACHED) is TargetOutcome.REACHED:
                outcomes[progress.target] = progress.outcome
        return outcomes

    @property
    def later(self) -> list[str]:
        """The other targets that still have a round."""
        return [progress.target for progress in self._waiting() if progress is not self.current]

    @property
    def earlier(self) -> list[str]:
        """The targets that may come before this one's next round; empty if it has none."""
        if not self.another_round:
            return []
        return [each.target for each in self._waiting() if each.round < self.current.round or self._due(each)]

    def decide(self, outcome: TargetOutcome) -> None:
        """Record the outcome of the current target."""
        self.current.outcome = outcome

    def next_target(self, preferred: str = "") -> None:
        """Continue with a target that had the fewest rounds or is due; the caller has checked `more_targets`.

        Args:
            preferred: This one rather than another of them.
        """
        waiting = self._waiting()
        if not waiting:
            raise IndexError("no target is left in the queue")
        fewest = min(progress.round for progress in waiting)
        first = [progress for progress in waiting if progress.round == fewest or self._due(progress)]
        names = [progress.target for progress in first]
        name = preferred if preferred in names else self.first_of(names)
        self._begin(first[names.index(name)])

    def _due(self, progress: TargetProgress) -> bool:
        return progress is not self.current and self.due(progress.target)

    def _waiting(self) -> list[TargetProgress]:
        return [each for each in self.targets if each.outcome is not TargetOutcome.REACHED and each.round < self.rounds]

    def _begin(self, progress: TargetProgress) -> None:
        progress.round += 1
        progress.outcome, progress.time_s = TargetOutcome.PENDING, None  # also of one that was given up before
        self.current = progress
