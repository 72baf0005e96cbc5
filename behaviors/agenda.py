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
        turns: How often it was its turn.
    """

    target: str
    fate: Fate = Fate.PENDING
    time_s: float | None = None
    attempts: int = 0
    turns: int = 0


class Agenda:
    """The targets in order; with more than one round, those given up are tried again after the last.

    Args:
        targets: Names in order, at least one.
        rounds: How often it is a target's turn at most.
    """

    def __init__(self, targets: Sequence[str], rounds: int = 1) -> None:
        self.errands = [Errand(target) for target in targets]
        self.rounds = rounds
        self._begin(self.errands[0])

    @property
    def target(self) -> str:
        """Name of the target being pursued."""
        return self.errand.target

    @property
    def round(self) -> int:
        """How often it has been the present target's turn, from 1."""
        return self.errand.turns

    @property
    def more_targets(self) -> bool:
        """Whether there is another target to go for once the present one is decided."""
        return bool(self._waiting())

    @property
    def achieved(self) -> bool:
        """Whether every target has been reached."""
        return all(errand.fate is Fate.REACHED for errand in self.errands)

    @property
    def later(self) -> list[str]:
        """Further targets whose turn is still to come, or to come again."""
        return [errand.target for errand in self._waiting() if errand is not self.errand]

    @property
    def earlier(self) -> list[str]:
        """Targets that may be gone for before this one's next turn, if it has one: their turn has come less often."""
        if self.errand.turns == self.rounds:
            return []
        return [errand.target for errand in self._waiting() if errand.turns < self.errand.turns]

    def decide(self, fate: Fate) -> None:
        """Write down what became of the present target."""
        self.errand.fate = fate

    def next_target(self, preferred: str = "") -> None:
        """Go on to the next target; the caller has checked `more_targets`.

        Args:
            preferred: Rather this one than the first in order, among those whose turn has come least often.
        """
        waiting = self._waiting()
        if not waiting:
            raise IndexError("no target is left on the agenda")
        fewest = min(errand.turns for errand in waiting)
        first = [errand for errand in waiting if errand.turns == fewest]
        self._begin(next((errand for errand in first if errand.target == preferred), first[0]))

    def _waiting(self) -> list[Errand]:
        return [each for each in self.errands if each.fate is not Fate.REACHED and each.turns < self.rounds]

    def _begin(self, errand: Errand) -> None:
        errand.turns += 1
        self.errand = errand
