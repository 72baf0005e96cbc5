"""The missions of a sweep: a drawn room with targets in order."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

from behaviors.mission import Mission
from nxtdrive.mission.setup import PICTURES
from sim_backend.link import NO_FAULTS, LinkFaults
from sim_backend.scenarios.classes import draw_room
from sim_backend.scenarios.extras import USB_MS, Extras, Sight
from sim_backend.scenarios.room_builder import PRINT_MM, RoomBuilder
from sim_backend.world.world_file import WorldFile

CRUISE_MM_S = 200.0
"""The robot's cruising speed, the same for all policies."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """One test.

    Attributes:
        kind: Its class.
        seed: Its seed; class and seed determine everything else.
        world: The room and its events.
        mission: The targets in order.
        faults: Faults of the link.
        latency_ms: Round-trip time of the link.
        sight: Conditions that degrade the view.
    """

    kind: str
    seed: int
    world: WorldFile
    mission: Mission
    faults: LinkFaults = NO_FAULTS
    latency_ms: float = USB_MS
    sight: Sight = field(default_factory=Sight)


@cache
def draw_scenario(kind: str, seed: int) -> Scenario:
    """Draw the scenario of a class and a seed.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No sound room was found: the class's ranges are wrong.
    """
    builder, extras = draw_room(kind, seed)
    title = f"{kind}-{seed}"
    mission = _mission(title, builder, extras)
    return Scenario(kind, seed, builder.world(title), mission, extras.faults, extras.latency_ms, extras.sight)


def _mission(title: str, builder: RoomBuilder, extras: Extras) -> Mission:
    return Mission.model_validate(
        {
            "mission": {"name": title, "targets": list(builder.targets), "time_limit_s": extras.time_limit_s},
            **{profile: {"cruise_mm_s": CRUISE_MM_S} for profile in ("thesis", "adaptive")},
            "target": {
                name: {"detector": "picture", "pictures": [str(PICTURES / f"{name}.png")], "height_mm": PRINT_MM[1]}
                for name in builder.targets
            },
            "robot": extras.robot,
        }
    )
