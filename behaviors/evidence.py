"""The evidence for a choice of recovery: plain values, which the journal has in full."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from typing import Annotated, Any, ClassVar, cast

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from behaviors.events import Reason
from behaviors.failures import Blocker
from behaviors.journal import plain
from behaviors.ports import Point
from behaviors.return_types import WrongReturn, checked, place
from input_files.pydantic_words import first_mistake

Chance = Annotated[float, Field(ge=0, le=1)]
"""A probability; a journal's is checked when it is read."""


@dataclass(frozen=True, slots=True)
class Detour:
    """A path around what blocks the straight one.

    Attributes:
        extra_s: How much longer it takes than the straight path would.
        route: Waypoints, without the current place.
        unknown_mm: How much of the path to the target, around and then straight, crosses unknown floor.
    """

    extra_s: float
    route: tuple[Point, ...]
    unknown_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A place from which the target may be seen.

    Attributes:
        travel_s: Time to get there.
        scan_s: Time to scan there.
        chance: Probability that this finds the target, 0..1.
        route: Waypoints; the last one is the place. Empty for the current place.
    """

    travel_s: float
    scan_s: float
    chance: Chance
    route: tuple[Point, ...] = ()

    @property
    def seconds(self) -> float:
        """Time for both."""
        return self.travel_s + self.scan_s


@dataclass(frozen=True, slots=True)
class AlternativeTarget:
    """Another target that was seen, is not reached yet, and may be pursued instead.

    Attributes:
        target: Its name.
        travel_s: Time to get to where it was seen, along paths that are known to be passable.
        age_s: How long ago that was.
        chance: Probability that it is still there, 0..1.
    """

    target: str
    travel_s: float
    age_s: float
    chance: Chance = 1.0


@dataclass(frozen=True, slots=True)
class Evidence:
    """The evidence for a choice of recovery.

    Attributes:
        target: Name of the target.
        reason: Why the last attempt failed.
        seen_since_search: Whether the target was recognised since the last search began (the thesis's `exist`).
        researches: Searches for this target after the first, in this round.
        round: How many times the list of targets has been begun, from 1.
        targets_left: Targets that are not reached and whose turn is now or later, this one included.
        spent_s: Time since its pursuit in this round began, or since its last sighting that still counts: one whose
            place was looked at in vain, or whose object was rejected, does not.
        blocker: The obstacle in the way, if any.
        detour: A path around it, if there is one.
        blocked: The place to look from beyond it, if the robot was driving to one.
        here: Another scan from here, if it was weighed.
        viewpoints: Other places to look from, the most promising first.
        others: Other targets that may be pursued instead.
        repeats: How often each recovery, by name, was chosen at this place for this target.
        tries: Choices for this target since it was last approached.
        failures: How often attempts failed at this place for this reason in this turn of the target, this one included.
        run: How many of them in a row.
    """

    __pydantic_config__: ClassVar = ConfigDict(allow_inf_nan=False)

    target: str
    reason: Reason
    seen_since_search: bool
    researches: int
    round: int = 1
    targets_left: int = 1
    spent_s: float = 0.0
    blocker: Blocker | None = None
    detour: Detour | None = None
    blocked: Viewpoint | None = None
    here: Viewpoint | None = None
    viewpoints: tuple[Viewpoint, ...] = ()
    others: tuple[AlternativeTarget, ...] = ()
    repeats: Mapping[str, int] = field(default_factory=dict)
    tries: int = 0
    failures: int = 0
    run: int = 0

    def known(self) -> dict[str, Any]:
        """Return it as plain values for a journal's record, which has the target; values not measured are left out."""
        return {
            name: value
            for name, value in asdict(self).items()
            if name in _ALWAYS or (name != "target" and value != _BLANK[name])
        }


_ALWAYS = ("reason", "seen_since_search", "researches")
_BLANK = asdict(Evidence("", Reason.MISSION_STARTED, seen_since_search=False, researches=0))
_FORMER_NAMES = {"exist": "seen_since_search"}
"""Keys of journals written by earlier versions."""


def evidence_from(target: str, known: Mapping[str, Any]) -> Evidence:
    """Read the evidence of a journal's choice; the inverse of `Evidence.known`.

    Raises:
        ValueError: It is not the evidence of a choice.
    """
    values = {_FORMER_NAMES.get(name, name): value for name, value in known.items()}
    return _adapter().validate_python({**values, "target": target})


def checked_evidence(complete: Callable[..., object], basis: Evidence) -> Evidence:
    """Call a profile's method that completes the evidence.

    Args:
        complete: A bound method.
        basis: Its argument.

    Returns:
        The evidence as a journal has it, with rounded numbers, so that the choice follows from the journal.

    Raises:
        WrongReturn: It returned something else, or a journal cannot have one of its values.
    """
    evidence = checked(complete, Evidence, basis)
    try:
        return evidence_from(evidence.target, cast("dict[str, Any]", plain(evidence.known())))
    except ValidationError as error:
        wrong = first_mistake(error.errors())
    except TypeError as error:
        wrong = str(error)
    raise WrongReturn(f"{place(complete)} returned evidence that a journal cannot have: {wrong}")


@cache
def _adapter() -> TypeAdapter[Evidence]:
    """Return the reader of evidence; making it takes 12 ms, too long for every program's start."""
    return TypeAdapter(Evidence)
