"""Classes of scenarios: class and seed determine the room, its events and everything else.

The robot's own actions trigger the events ("once lena has been in view for 1.2 s and the robot is more than a metre
away, a person steps in between"), so that every profile faces the same test. Only outages of the link, people and
pictures that move to and fro, and sensors and wheels that fail are timed.

Source of the classes and their ranges: docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from random import Random

from sim_backend.scenarios.changes import CHANGES
from sim_backend.scenarios.effects import EFFECTS, PLAIN, generate_plain
from sim_backend.scenarios.handicaps import HANDICAPS
from sim_backend.scenarios.hard import HARD, perturb_robot
from sim_backend.scenarios.realities import REALITIES
from sim_backend.scenarios.room_builder import RoomBuilder, RoomGenerator
from sim_backend.scenarios.rooms import ROOMS

TRIES = 500
"""Largest number of rooms to generate until one has a free start and reachable targets."""

_GENERATORS: dict[str, RoomGenerator] = {**ROOMS, **CHANGES, **HANDICAPS}

CLASSES: dict[str, RoomGenerator] = {
    kind: _GENERATORS[kind]
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
"""A function per class that generates a room from a random generator; see docs/evaluation.md."""

HARD_CLASSES = tuple(HARD)
"""The classes of the suite `hard`; see docs/evaluation.md."""
REALITY_CLASSES = (*REALITIES, *EFFECTS)
"""The classes of the suite `reality`, which come closer to real robots; see docs/reality.md."""
ALL_CLASSES = tuple(dict.fromkeys((*CLASSES, *REALITY_CLASSES, *HARD_CLASSES)))


def generate_room(kind: str, seed: int) -> RoomBuilder:
    """Generate a room of a class in which the mission can be solved.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No solvable room was found: the class's ranges are wrong.
    """
    random, name = Random(f"{kind}-{seed}"), f"{kind}-{seed}"
    if kind not in EFFECTS:
        generate = CLASSES.get(kind) or HARD.get(kind) or REALITIES[kind]
        builder = _first_solvable(lambda: generate(random), name)
        if kind in HARD and seed % 2 and kind not in REALITIES:
            perturb_robot(builder)
        return builder
    # the same room for all effects
    plain = Random(f"{PLAIN}-{seed}")
    room = _first_solvable(lambda: generate_plain(plain), name)

    def switched_on() -> RoomBuilder:
        builder = replace(deepcopy(room), random=random)
        EFFECTS[kind](builder)
        return builder

    return _first_solvable(switched_on, name)


def _first_solvable(generate: Callable[[], RoomBuilder], name: str) -> RoomBuilder:
    """Return the first generated room in which the mission can be solved."""
    for _ in range(TRIES):
        builder = generate()
        if builder.solvable():
            return builder
    raise RuntimeError(f"no solvable room for {name} in {TRIES} tries")
