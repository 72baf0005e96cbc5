"""Typed failures: what a skill reports when it fails."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from behaviors.events import Fact


@dataclass(frozen=True, slots=True)
class Blocker:
    """Something between the robot and the estimated place of the target.

    Attributes:
        range_mm: How far ahead of the sonar it is.
        age_s: How long it has been known; 0 in a skill's report, which the world model completes.
        moving: Whether it appeared while the robot watched, now or since it has been known.
        hides: Whether it hides the target from the camera. If the camera sees past it, it is likely to be furniture.
        bearing_deg: Its direction from the robot's front.
    """

    range_mm: float
    age_s: float = 0.0
    moving: bool = False
    hides: bool = False
    bearing_deg: float = 0.0


class TargetFinding(StrEnum):
    """What a failure shows about where the target is."""

    NOT_HERE = "not_here"
    """A scan from here did not show it."""
    MOVED = "moved"
    """It has left the place where it was seen."""
    NOT_THERE = "not_there"
    """A longer look at the place where it was seen did not show it."""
    UNCERTAIN = "uncertain"
    """What was taken for it is found no more steadily than a look-alike."""
    LOOK_ALIKE = "look_alike"
    """What was taken for it is something else."""


@dataclass(frozen=True, slots=True)
class Failure(Fact):
    """Why a skill failed, and what the world model should learn from it.

    Attributes:
        blocker: What was in the way, if anything.
        mapped: Whether the blocker comes from the map, which then has nothing to learn from it.
        finding: What the failure says about the target, if anything.
    """

    blocker: Blocker | None = None
    mapped: bool = False
    finding: TargetFinding | None = None
