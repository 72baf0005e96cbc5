"""Classes of scenarios: class and seed determine the room, its events and everything else.

The robot's own actions trigger the events ("once lena has been in view for 1.2 s and the robot is more than a metre
away, a person steps in between"), so that every policy faces the same test. Only outages of the link, which have no
cause within the room, are timed.

Source of the classes and their ranges: docs/evaluation.md.
"""

from __future__ import annotations

from random import Random

from .changes import CHANGES
from .extras import Draw, Extras
from .handicaps import HANDICAPS
from .realities import REALITIES
from .room_builder import RoomBuilder
from .rooms import ROOMS

TRIES = 500
"""Largest number of rooms to draw until one has a free start and reachable targets."""

_DRAWS: dict[str, Draw] = {**ROOMS, **CHANGES, **HANDICAPS}

CLASSES: dict[str, Draw] = {
    kind: _DRAWS[kind]
    for kind in (
        "open",
        "far",
        "clutter",
        "block_transient",
        "block_permanent",
        "patrol",
        "absent",
        "moved",
        "dim",
        "slip",
        "compass_distortion",
        "link",
        "distractor",
        "camera_loss",
        "wall_start",
        "narrow_door",
    )
}
"""A function per class that draws a room from a random generator; see docs/evaluation.md."""

ALL_CLASSES = CLASSES | REALITIES
"""With the classes that switch on one effect of reality each; see docs/reality.md."""


def draw_room(kind: str, seed: int) -> tuple[RoomBuilder, Extras]:
    """Draw a room of a class in which the mission can be solved, and what the class specifies beside it.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No sound room was found: the class's ranges are wrong.
    """
    random = Random(f"{kind}-{seed}")
    for _ in range(TRIES):
        builder, extras = ALL_CLASSES[kind](random)
        if builder.sound():
            return builder, extras
    raise RuntimeError(f"no sound room for {kind}-{seed} in {TRIES} tries")
