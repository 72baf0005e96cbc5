"""Which target is next: the ordered targets of a mission and what became of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum


class Fate(StrEnum):
    """What became of a target."""

    PENDING = "pending"
    REACHED = "reached"
    GIVEN_UP = "given_up"


@dataclass(slots=True)
class Errand:
    """One target of the mission.

    Attributes:
        target: Its name.
        fate: What became of it so far.
        time_s: When that was decided, seconds of mission time; None while pending.
        attempts: Searches started for it, over all rounds.
        tries: How often it was its turn.
    """

    target: str
    fate: Fate = Fate.PENDING
    time_s: float | None = None
    attempts: int = 0
    tries: int = 1


class Agenda:
    """The targets in order; with more than one round, those given up are tried again after the last.

    Args:
        targets: Names in order, at least one.
        rounds: How often the list is gone through at most.
    """

    def __init__(self, targets: Sequence[str], rounds: int = 1) -> None:
        self.errands = [Errand(target) for target in targets]
        self.round = 1
        self.rounds = rounds
        self._current = 0

    @property
    def errand(self) -> Errand:
        """The target being pursued."""
        return self.errands[self._current]

    @property
    def target(self) -> str:
        """Name of the target being pursued."""
        return self.errand.target

    @property
    def more_targets(self) -> bool:
        """Whether there is another target to go for once the present one is decided."""
        return self._following() is not None

    @property
    def achieved(self) -> bool:
        """Whether every target has been reached."""
        return all(errand.fate is Fate.REACHED for errand in self.errands)

    def decide(self, fate: Fate) -> None:
        """Write down what became of the present target."""
        self.errand.fate = fate

    def next_target(self) -> None:
        """Go on to the next target; the caller has checked `more_targets`."""
        following = self._following()
        if following is None:
            raise IndexError("no target is left on the agenda")
        if following <= self._current:
            self.round += 1
        if self.errands[following].fate is Fate.GIVEN_UP:
            self.errands[following].tries += 1
        self._current = following

    def _following(self) -> int | None:
        for i in range(self._current + 1, len(self.errands)):
            if self.errands[i].fate is not Fate.REACHED:
                return i
        if self.round < self.rounds:
            for i in range(self._current + 1):
                if self.errands[i].fate is not Fate.REACHED:
                    return i
        return None
