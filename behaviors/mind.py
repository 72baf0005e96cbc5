"""What differs between profiles: what is done in each state, and what is chosen after a failure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from behaviors.agenda import Agenda
from behaviors.events import Fact
from behaviors.mission import Mission
from behaviors.recovery import Choice, Evidence, RecoveryPolicy, ThesisPolicy
from behaviors.skills import Arrive, Moving, Search, Senses, Service, Waiting


class Mind(Protocol):
    """A profile at work in one mission."""

    def service(self, state: str, choice: Choice | None) -> Service:
        """What to do in a state of the mission that was just entered.

        Args:
            state: ``search``, ``arrive``, or the recovery that was chosen.
            choice: The last choice.

        Raises:
            KeyError: The profile does nothing in such a state.
        """
        ...

    def evidence(self, failure: Evidence, fact: Fact) -> Evidence:
        """What is known of a failure; called once for each.

        Args:
            failure: What the executive itself knows.
            fact: The failure, with what was measured.
        """
        ...

    def select(self, evidence: Evidence) -> Choice:
        """Choose a recovery for this evidence, which the journal has in full."""
        ...


MakeMind = Callable[[Senses, Mission, Agenda], Mind]


class ThesisMind:
    """The profile of the thesis.

    Args:
        senses: What to work with.
        mission: Its table ``thesis`` has the numbers.
        agenda: Whose present target is pursued.
        policy: Another rule for the recoveries than the thesis's.
    """

    def __init__(self, senses: Senses, mission: Mission, agenda: Agenda, policy: RecoveryPolicy | None = None) -> None:
        self._senses = senses
        self._agenda = agenda
        self._policy = policy or ThesisPolicy.of(mission.thesis)

    def service(self, state: str, choice: Choice | None) -> Service:
        """One of the thesis's services."""
        if state == "search":
            return Search(self._senses, self._agenda.target)
        if state == "arrive":
            return Arrive(self._senses, self._agenda.target)
        if state == "wait" and choice:
            return Waiting(self._senses, choice.wait_s)
        if state == "move_to" and choice:
            return Moving(self._senses, choice.turn_deg)
        raise KeyError(state)

    def evidence(self, failure: Evidence, fact: Fact) -> Evidence:  # noqa: ARG002 - another mind's may need it
        """The thesis knows no more than whether the target was recognised."""
        return failure

    def select(self, evidence: Evidence) -> Choice:
        """Choose by the policy."""
        return self._policy.select(evidence)
