"""A random scenario with its mission, checked as a mission file is."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

from behaviors.mission import Mission
from sim_backend.scenarios.classes import generate_room
from sim_backend.scenarios.conditions import Conditions
from sim_backend.world.world_file import WorldFile


@dataclass(frozen=True, slots=True)
class Scenario:
    """One scenario.

    Attributes:
        kind: Its class.
        seed: Its seed; class and seed determine everything else.
        world: The room, its events, and the robot as it is.
        mission: Targets in order, time limit, and the robot as it describes it.
        conditions: Those besides the room: the link, the view.
    """

    kind: str
    seed: int
    world: WorldFile
    mission: Mission
    conditions: Conditions = field(default_factory=Conditions)


@lru_cache(maxsize=64)
def generate_scenario(kind: str, seed: int) -> Scenario:
    """Generate the scenario of a class and a seed.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No solvable room was found: the class's ranges are wrong.
    """
    room, title = generate_room(kind, seed), f"{kind}-{seed}"
    mission = Mission.model_validate(room.mission(title))
    return Scenario(kind, seed, room.world(title), mission, room.conditions)
