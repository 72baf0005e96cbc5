"""What to do after a failure: the only place where judgement lives.

A policy turns evidence into a choice. It has no robot and no clock, so it can be tested with plain values, and a
journal can be replayed through another policy.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from behaviors.events import Reason


class Recovery(StrEnum):
    """What can be done after a failure."""

    WAIT = "wait"
    MOVE_TO = "move_to"
    CHANGE_TARGET = "change_target"


@dataclass(frozen=True, slots=True)
class Evidence:
    """What is known when a choice is due.

    Attributes:
        target: Name of the target.
        reason: Why the last try failed.
        exist: Whether the target was recognised since the last search began (the thesis's `exist`).
        researches: Searches for this target beyond the first, in this round.
    """

    target: str
    reason: Reason
    exist: bool
    researches: int


@dataclass(frozen=True, slots=True)
class Choice:
    """What to do, and why.

    Attributes:
        kind: The recovery.
        why: One clause for the journal.
        wait_s: How long to wait, for `Recovery.WAIT`.
        turn_deg: Which way to move off, positive right, for `Recovery.MOVE_TO`.
    """

    kind: Recovery
    why: str
    wait_s: float = 0.0
    turn_deg: float = 0.0


class RecoveryPolicy(Protocol):
    """A rule that chooses a recovery."""

    def select(self, evidence: Evidence) -> Choice:
        """Choose for this evidence; must not depend on anything else."""
        ...


@dataclass(frozen=True, slots=True)
class ThesisPolicy:
    """The rule of the 2017 thesis: seen but not reached: wait; not seen: move to; two re-searches, then change target.

    Attributes:
        wait_s: The thesis waits 15 s.
        turn_deg: The thesis turns 90 degrees to the right.
        max_researches: The thesis searches again twice.
    """

    wait_s: float = 15.0
    turn_deg: float = 90.0
    max_researches: int = 2

    def select(self, evidence: Evidence) -> Choice:
        """Choose as the thesis's select plan does. Source: docs/thesis.md, plans."""
        if evidence.researches >= self.max_researches:
            return Choice(Recovery.CHANGE_TARGET, f"searched again {evidence.researches} times")
        if evidence.exist:
            return Choice(Recovery.WAIT, "the target was recognised but not reached", wait_s=self.wait_s)
        return Choice(Recovery.MOVE_TO, "the target was not recognised", turn_deg=self.turn_deg)
