"""A random scenario with its mission, checked as a mission file is."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

from behaviors.mission import Mission
from sim_backend.link import NO_FAULTS, LinkFaults
from sim_backend.scenarios.extras import USB_MS, Sight
from sim_backend.scenarios.generated import generate
from sim_backend.world.world_file import WorldFile


@dataclass(frozen=True, slots=True)
class Scenario:
    """One scenario; see `sim_backend.scenarios.generated.GeneratedScenario`.

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


@lru_cache(maxsize=64)
def generate_scenario(kind: str, seed: int) -> Scenario:
    """Generate the scenario of a class and a seed.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No solvable room was found: the class's ranges are wrong.
    """
    generated = generate(kind, seed)
    mission = Mission.model_validate(generated.mission)
    return Scenario(kind, seed, generated.world, mission, generated.faults, generated.latency_ms, generated.sight)
