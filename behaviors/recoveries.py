"""The recoveries: what can be done after a failure, and what a policy is, which chooses one.

`RECOVERIES` has one entry for each. The chart's guard, the console, the map, the status line, explanations and the
sweep read it; CONTRIBUTING.md says what else a new recovery needs. A policy turns evidence into a choice. It has no
robot and no clock, so it can be tested with plain values and rerun on a journal's evidence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, Protocol, runtime_checkable

from behaviors.evidence import Evidence
from behaviors.ports import Point
from behaviors.return_types import WrongReturn, checked, place
from input_files.mistakes import excerpt


@dataclass(frozen=True, slots=True)
class Recovery:
    """Something that can be done after a failure.

    Attributes:
        name: Its name in the journal.
        label: A short imperative, for the status line and the map.
        describe: Says what a choice of it does, with the choice's numbers.
        color: Of its path and its mark on the map: red, green, blue, each 0..255.
        marker: Shape of its mark on the map, one of `nxtdrive.drawing.sheet.MARKERS`.
        dash: Its path on the map: lengths of strokes and gaps in turn, pixels; none for a solid line.
        fits: The cause of a failure for which it is the right choice, as `nxtdrive.tools.sweep.causes` names them;
            empty for none.
        leads_to: The chart's states that it leads to, by guards; its name when empty.
    """

    name: str
    label: str
    describe: Callable[[Choice], str]
    color: tuple[int, int, int]
    marker: str
    dash: tuple[int, ...] = ()
    fits: str = ""
    leads_to: tuple[str, ...] = ()

    @property
    def states(self) -> tuple[str, ...]:
        """The chart's states that it leads to."""
        return self.leads_to or (self.name,)


@dataclass(frozen=True, slots=True)
class Choice:
    """What to do, and why.

    Attributes:
        kind: The recovery.
        why: One clause for the journal.
        wait_s: How long to wait, for `WAIT`.
        turn_deg: Which way to turn before moving off, positive right, for the thesis's `MOVE_TO`.
        route: Waypoints, for `DETOUR` and for `MOVE_TO` a place.
        instead: The target to pursue, for `CHANGE_TARGET`; empty for the next in order.
        operator: Whether a person confirmed it or chose it.
        proposed: The policy's own choice, if that person chose something else.

    Raises:
        TypeError: `kind` is not one of the recoveries, or a number, a text or `route` is of a wrong type.
        ValueError: A number is not finite, or the time negative.
    """

    kind: Recovery
    why: str
    wait_s: float = 0.0
    turn_deg: float = 0.0
    route: tuple[Point, ...] = ()
    instead: str = ""
    operator: bool = False
    proposed: Choice | None = None

    def __post_init__(self) -> None:
        """Check the values, which may come from a profile of another package."""
        if not isinstance(self.kind, Recovery) or RECOVERIES.get(self.kind.name) is not self.kind:
            known = ", ".join(each.name.upper() for each in RECOVERIES.values())
            given = self.kind.name if isinstance(self.kind, Recovery) else self.kind
            raise TypeError(f"kind must be one of {known} of behaviors.recoveries, not {given!r}")
        for name, value in (("wait_s", self.wait_s), ("turn_deg", self.turn_deg)):
            if not isinstance(value, Real):
                raise TypeError(f"{name} must be a number, not {value!r}")
            if not math.isfinite(value):
                raise ValueError(f"{name} must be finite, not {value}")
        if self.wait_s < 0:
            raise ValueError(f"wait_s must be 0 or more, not {self.wait_s}")
        for name, text in (("why", self.why), ("instead", self.instead)):
            if not isinstance(text, str):
                raise TypeError(f"{name} must be text, not {text!r}")
        if not isinstance(self.route, tuple | list) or not all(map(_is_point, self.route)):
            raise TypeError(f"route must be places (x_mm, y_mm), not {self.route!r}")

    def words(self) -> str:
        """Describe the action: "wait up to 4.0 s"."""
        return self.kind.describe(self)

    def record(self) -> dict[str, Any]:
        """Return it as plain values for the journal; numbers that are not used are left out."""
        values: dict[str, Any] = {"wait_s": self.wait_s, "turn_deg": self.turn_deg, "route": self.route}
        values |= {"instead": self.instead, "operator": self.operator}
        values |= {"proposed": self.proposed.record() if self.proposed else None}
        return {"choice": self.kind.name, "why": self.why} | {name: value for name, value in values.items() if value}


def _is_point(value: object) -> bool:
    return (
        isinstance(value, tuple | list)
        and len(value) == 2
        and all(isinstance(each, Real) and math.isfinite(each) for each in value)
    )


def place_words(place: Point) -> str:
    """Describe where a place is, in the frame of the start."""
    x_m, y_m = round(place[0] / 1000, 1), round(place[1] / 1000, 1)
    along, across = "behind" if x_m < 0 else "ahead", "left" if y_m < 0 else "right"
    distances = ", ".join(f"{abs(length):.1f} m {way}" for length, way in ((x_m, along), (y_m, across)) if length)
    if not distances:
        return "the start"
    return f"{distances}{' of' if y_m or x_m > 0 else ''} the start"


def _describe_move(choice: Choice) -> str:
    if choice.route:
        return f"look from {place_words(choice.route[-1])}"
    return f"turn {choice.turn_deg:+.0f}° and move off"


WAIT = Recovery(
    "wait",
    label="wait",
    describe=lambda choice: f"wait up to {choice.wait_s:.1f} s",
    color=(220, 140, 0),
    marker="square",
    dash=(3, 5),
    fits="blocked_short",
)
DETOUR = Recovery(
    "detour",
    label="go round",
    describe=lambda choice: "go round" + (f", to {place_words(choice.route[-1])}" if choice.route else ""),
    color=(200, 80, 0),
    marker="diamond",
    dash=(16, 5, 3, 5),
    fits="blocked_long",
)
MOVE_TO = Recovery(
    "move_to",
    label="look elsewhere",
    describe=_describe_move,
    color=(150, 60, 180),
    marker="triangle_up",
    dash=(12, 7),
    fits="elsewhere",
)
RESCAN = Recovery(
    "rescan",
    label="look again",
    describe=lambda _: "look again from here",
    color=(40, 160, 160),
    marker="cross",
    dash=(6, 5),
    fits="missed",
)
CHANGE_TARGET = Recovery(
    "change_target",
    label="leave it",
    describe=lambda choice: "leave this target" + (f" and go for {choice.instead}" if choice.instead else ""),
    color=(200, 40, 40),
    marker="triangle_down",
    leads_to=("left", "gave_up"),
)

RECOVERIES = {recovery.name: recovery for recovery in (WAIT, DETOUR, MOVE_TO, RESCAN, CHANGE_TARGET)}
"""All recoveries, by name."""


def recovery_in(state: str) -> Recovery | None:
    """Return the recovery that leads to a state of the chart, if one does."""
    return next((each for each in RECOVERIES.values() if state in each.states), None)


def choice_from(data: Mapping[str, Any]) -> Choice:
    """Read the choice of a journal's record; the inverse of `Choice.record`.

    Raises:
        KeyError, TypeError, ValueError: It is not the record of a choice.
    """
    return Choice(
        RECOVERIES[data["choice"]],
        str(data.get("why", "")),
        wait_s=float(data.get("wait_s", 0.0)),
        turn_deg=float(data.get("turn_deg", 0.0)),
        route=tuple((float(x_mm), float(y_mm)) for x_mm, y_mm in data.get("route", [])),
        instead=str(data.get("instead", "")),
        operator=bool(data.get("operator", False)),
        proposed=choice_from(data["proposed"]) if "proposed" in data else None,
    )


@runtime_checkable
class RecoveryPolicy(Protocol):
    """A rule that chooses a recovery."""

    def select(self, evidence: Evidence) -> Choice:
        """Choose for this evidence; must not depend on anything else."""
        ...


def checked_choice(select: Callable[..., object], evidence: Evidence, targets: Collection[str]) -> Choice:
    """Call a method that chooses a recovery and return its choice.

    Args:
        select: A bound method of a profile or of a policy.
        evidence: Its argument.
        targets: Those of the mission.

    Raises:
        WrongReturn: It returned something else, or chose a target that the mission does not have.
    """
    choice = checked(select, Choice, evidence)
    if choice.instead and choice.instead not in targets:
        known = ", ".join(map(repr, targets))
        raise WrongReturn(f"{place(select)} chose the target {excerpt(choice.instead)}; this mission has {known}")
    return choice


def per_success_s(seconds: float, chance: float) -> float:
    """Return the expected seconds for one success with unlimited attempts; infinity without a chance."""
    return seconds / chance if chance > 0 else math.inf


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate for a choice.

    Attributes:
        choice: What would be done.
        seconds: How long that is expected to take; for a detour, beyond the straight path.
        chance: Probability that it succeeds, 0..1.
        otherwise_s: Expected seconds for one success after it has failed; None for the same again and again.
        then_s: Expected seconds after its success, if that only clears the path for something else.
        situation: What `behaviors.adaptive.chances` counts its outcome under; empty for nothing.
    """

    choice: Choice
    seconds: float
    chance: float
    otherwise_s: float | None = None
    then_s: float = 0.0
    situation: str = ""

    @property
    def expected_s(self) -> float:
        """Expected seconds for one success; infinity without a chance."""
        if self.otherwise_s is not None:
            return self.seconds + self.chance * self.then_s + (1.0 - self.chance) * self.otherwise_s
        return per_success_s(self.seconds, self.chance) + self.then_s

    def record(self) -> dict[str, float | None]:
        """Return its numbers as plain values; infinity, which JSON lacks, becomes None."""
        numbers = {"seconds": self.seconds, "chance": self.chance, "expected_s": self.expected_s}
        return {name: round(value, 3) if math.isfinite(value) else None for name, value in numbers.items()}
