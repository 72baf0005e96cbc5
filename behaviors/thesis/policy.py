"""The policy of the thesis. Source: docs/thesis.md, plans."""

from __future__ import annotations

from behaviors.evidence import Evidence
from behaviors.mission import ThesisParameters
from behaviors.recoveries import CHANGE_TARGET, MOVE_TO, WAIT, Choice

USUAL = ThesisParameters()


class ThesisPolicy:
    """The rule of the 2017 thesis: seen but not reached: wait; not seen: move to; two re-searches, then change target.

    Args:
        parameters: The mission's numbers; the thesis waits 15 s, turns right by 90 degrees and searches again twice.
    """

    def __init__(self, parameters: ThesisParameters = USUAL) -> None:
        self._parameters = parameters

    def select(self, evidence: Evidence) -> Choice:
        """Choose as the thesis's select plan does."""
        if evidence.researches >= self._parameters.max_researches:
            return Choice(CHANGE_TARGET, f"searched again {evidence.researches} times")
        wait, move_to = self.recoveries()
        return wait if evidence.seen_since_search else move_to

    def recoveries(self) -> tuple[Choice, Choice]:
        """Return what it does for a target that was recognised, and for one that was not."""
        return (
            Choice(WAIT, "the target was recognised but not reached", wait_s=self._parameters.wait_s),
            Choice(MOVE_TO, "the target was not recognised", turn_deg=self._parameters.turn_deg),
        )
