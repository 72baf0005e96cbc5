"""What to do after a failure: the only place where judgement lives.

A policy turns evidence into a choice. It has no robot and no clock, so it can be tested with plain values, and a
journal can be replayed through another policy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any, Protocol, Self

from pydantic import TypeAdapter

from behaviors.events import Reason
from behaviors.failures import Blocker
from behaviors.mission import ThesisParameters

Point = tuple[float, float]
"""x_mm, y_mm in the frame of the robot's start."""


class Recovery(StrEnum):
    """What can be done after a failure."""

    WAIT = "wait"
    MOVE_TO = "move_to"
    DETOUR = "detour"
    RESCAN = "rescan"
    CHANGE_TARGET = "change_target"


@dataclass(frozen=True, slots=True)
class Detour:
    """A way round what blocks the straight one.

    Attributes:
        extra_s: How much longer it takes than the straight way would.
        route: Points to drive through, without the present place.
    """

    extra_s: float
    route: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A place from which the target may be seen.

    Attributes:
        travel_s: Time to get there.
        scan_s: Time to look round there.
        chance: Probability that the target is found by that, 0..1.
        route: Points to drive through; the last one is the place. Empty for the present place.
    """

    travel_s: float
    scan_s: float
    chance: float
    route: tuple[Point, ...] = ()

    @property
    def seconds(self) -> float:
        """Time for all of it."""
        return self.travel_s + self.scan_s


@dataclass(frozen=True, slots=True)
class AlternativeTarget:
    """Another target that is not reached yet, was seen, and may be gone for instead.

    Attributes:
        target: Its name.
        travel_s: Time to get to where it was seen, by the ways that are known to be passable.
        age_s: How long ago that was.
        chance: Probability that it is still there, 0..1.
    """

    target: str
    travel_s: float
    age_s: float
    chance: float = 1.0


@dataclass(frozen=True, slots=True)
class Evidence:
    """What is known when a choice is due.

    Attributes:
        target: Name of the target.
        reason: Why the last try failed.
        exist: Whether the target was recognised since the last search began (the thesis's `exist`).
        researches: Searches for this target beyond the first, in this round.
        round: How often the list of targets is being gone through, from 1.
        targets_left: Targets that are not reached and still have their turn, this one included.
        spent_s: Time spent on this target in this round without nearing it.
        blocker: What is in the way, if something is.
        detour: A way round it, if there is one.
        here: What another look round from here promises, if anything.
        viewpoints: Other places to look from, the most promising first.
        others: Other targets that may be gone for instead.
        repeats: How often each recovery was chosen here already, for this target.
    """

    target: str
    reason: Reason
    exist: bool
    researches: int
    round: int = 1
    targets_left: int = 1
    spent_s: float = 0.0
    blocker: Blocker | None = None
    detour: Detour | None = None
    here: Viewpoint | None = None
    viewpoints: tuple[Viewpoint, ...] = ()
    others: tuple[AlternativeTarget, ...] = ()
    repeats: Mapping[Recovery, int] = field(default_factory=dict)

    def known(self) -> dict[str, Any]:
        """As plain values for the journal; what nobody looked into is left out, and the target stands there anyway."""
        return {
            name: value
            for name, value in asdict(self).items()
            if name in ("reason", "exist", "researches") or (name != "target" and value != _BLANK[name])
        }


_BLANK = asdict(Evidence("", Reason.MISSION_STARTED, exist=False, researches=0))


def evidence_from(target: str, known: Mapping[str, Any]) -> Evidence:
    """The evidence of a journal's choice; the inverse of `Evidence.known`.

    Raises:
        ValueError: It is not the evidence of a choice.
    """
    return TypeAdapter(Evidence).validate_python({**known, "target": target})


def _points(route: list[list[float]]) -> tuple[Point, ...]:
    return tuple((float(x_mm), float(y_mm)) for x_mm, y_mm in route)


@dataclass(frozen=True, slots=True)
class Choice:
    """What to do, and why.

    Attributes:
        kind: The recovery.
        why: One clause for the journal.
        wait_s: How long to wait, for `Recovery.WAIT`.
        turn_deg: Which way to move off, positive right, for the thesis's `Recovery.MOVE_TO`.
        route: Points to drive through, for `Recovery.DETOUR` and for `Recovery.MOVE_TO` to a place.
        instead: The target to go for, for `Recovery.CHANGE_TARGET`; empty for the next in order.
        operator: Whether a person confirmed it or chose it.
        proposed: What the policy would have done, when that person chose something else.
    """

    kind: Recovery
    why: str
    wait_s: float = 0.0
    turn_deg: float = 0.0
    route: tuple[Point, ...] = ()
    instead: str = ""
    operator: bool = False
    proposed: Choice | None = None

    def numbers(self) -> dict[str, Any]:
        """What was chosen beyond the kind, as plain values for the journal."""
        values: dict[str, Any] = {"wait_s": self.wait_s, "turn_deg": self.turn_deg, "route": self.route}
        values |= {"instead": self.instead, "operator": self.operator}
        if self.proposed is not None:
            values["proposed"] = {"choice": self.proposed.kind, "why": self.proposed.why, **self.proposed.numbers()}
        return {name: value for name, value in values.items() if value}


def choice_from(data: Mapping[str, Any]) -> Choice:
    """The choice of a journal's record.

    Raises:
        KeyError, TypeError, ValueError: It is not the record of a choice.
    """
    return Choice(
        Recovery(data["choice"]),
        str(data.get("why", "")),
        wait_s=float(data.get("wait_s", 0.0)),
        turn_deg=float(data.get("turn_deg", 0.0)),
        route=_points(data.get("route", [])),
        instead=str(data.get("instead", "")),
        operator=bool(data.get("operator", False)),
        proposed=choice_from(data["proposed"]) if "proposed" in data else None,
    )


class RecoveryPolicy(Protocol):
    """A rule that chooses a recovery."""

    def select(self, evidence: Evidence) -> Choice:
        """Choose for this evidence; must not depend on anything else."""
        ...


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate for a choice.

    Attributes:
        choice: What would be done.
        seconds: How long that is expected to take.
        chance: Probability that it leads on, 0..1.
    """

    choice: Choice
    seconds: float
    chance: float

    @property
    def expected_s(self) -> float:
        """Seconds a success costs, if one had as many tries as one likes; infinity without a chance."""
        return self.seconds / self.chance if self.chance > 0 else math.inf


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

    @classmethod
    def of(cls, profile: ThesisParameters) -> Self:
        """The rule with a mission's numbers."""
        return cls(profile.wait_s, profile.turn_deg, profile.max_researches)

    def select(self, evidence: Evidence) -> Choice:
        """Choose as the thesis's select plan does. Source: docs/thesis.md, plans."""
        if evidence.researches >= self.max_researches:
            return Choice(Recovery.CHANGE_TARGET, f"searched again {evidence.researches} times")
        wait, move_to = self.recoveries()
        return wait if evidence.exist else move_to

    def recoveries(self) -> tuple[Choice, Choice]:
        """What it does for a target that was recognised, and for one that was not."""
        return (
            Choice(Recovery.WAIT, "the target was recognised but not reached", wait_s=self.wait_s),
            Choice(Recovery.MOVE_TO, "the target was not recognised", turn_deg=self.turn_deg),
        )
