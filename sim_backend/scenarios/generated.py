"""Generate a scenario from a class and a seed: world, mission, robot, faults and limits, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sim_backend.bundled import PICTURES
from sim_backend.link import LinkFaults
from sim_backend.scenarios.classes import generate_room
from sim_backend.scenarios.extras import Sight
from sim_backend.scenarios.room_builder import PRINT_MM, RoomBuilder
from sim_backend.world.world_file import WorldFile

CRUISE_MM_S = 200.0
"""The robot's cruising speed, the same for all profiles."""


@dataclass(frozen=True, slots=True)
class GeneratedScenario:
    """A scenario, as a class and a seed determine it.

    Attributes:
        kind: The class.
        seed: The seed.
        world: The room, its events, and the robot as it is.
        mission: The tables of a mission's file: targets in order, time limit, and the robot as it describes it.
        faults: Faults of the link.
        latency_ms: Round-trip time of the link.
        sight: Conditions that degrade the view.
    """

    kind: str
    seed: int
    world: WorldFile
    mission: Mapping[str, Any]
    faults: LinkFaults
    latency_ms: float
    sight: Sight


def generate(kind: str, seed: int) -> GeneratedScenario:
    """Generate the scenario of a class and a seed.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No solvable room was found: the class's ranges are wrong.
    """
    builder = generate_room(kind, seed)
    title, extras = f"{kind}-{seed}", builder.extras
    world, mission = builder.world(title), _mission(title, builder)
    return GeneratedScenario(kind, seed, world, mission, extras.faults, extras.latency_ms, extras.sight)


def _mission(title: str, builder: RoomBuilder) -> dict[str, Any]:
    return {
        "mission": {"name": title, "targets": list(builder.targets), "time_limit_s": builder.extras.time_limit_s},
        **{profile: {"cruise_mm_s": CRUISE_MM_S} for profile in ("thesis", "adaptive")},
        "target": {
            name: {"detector": "picture", "pictures": [str(PICTURES / f"{name}.png")], "height_mm": PRINT_MM[1]}
            for name in builder.targets
        },
        "robot": dict(builder.extras.robot),
    }
