"""The policy of the thesis. Source: docs/thesis.md, plans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from behaviors.evidence import Evidence
from behaviors.mission import ThesisParameters
from behaviors.recoveries import CHANGE_TARGET, MOVE_TO, WAIT, Choice

USUAL = ThesisParameters()


@dataclass(frozen=True, slots=True)
class ThesisPolicy:
    """The rule of the 2017 thesis: seen but not reached: wait; not seen: move to; two re-searches, then change target.

    Attributes:
        wait_s: The thesis waits 15 s.
        turn_deg: The thesis turns 90 degrees to the right.
        max_researches: The thesis searches again twice.
    """

    wait_s: float = USUAL.wait_s
    turn_deg: float = USUAL.turn_deg
    max_researches: int = USUAL.max_researches

    @classmethod
    def of(cls, parameters: ThesisParameters) -> Self:
        """Make the rule with a mission's numbers."""
        return cls(parameters.wait_s, parameters.turn_deg, parameters.max_researches)

    def select(self, evidence: Evidence) -> Choice:
        """Choose as the thesis's select plan does."""
        if evidence.researches >= self.max_researches:
            return Choice(CHANGE_TARGET, f"searched again {evidence.researches} times")
        wait, move_to = self.recoveries()
        return wait if evidence.seen_since_search else move_to

    def recoveries(self) -> tuple[Choice, Choice]:
        """Return what it does for a target that was recognised, and for one that was not."""
        return (
            Choice(WAIT, "the target was recognised but not reached", wait_s=self.wait_s),
            Choice(MOVE_TO, "the target was not recognised", turn_deg=self.turn_deg),
        )
