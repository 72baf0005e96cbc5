"""Whole missions on the simulated brick, watched from outside by the simulation's ground truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from behaviors.executive import Executive, Report
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.operator import Ask
from behaviors.pause import Pause
from behaviors.profiles.registry import supervised
from behaviors.thesis.console import Console
from nxtdrive.brick import Brick
from nxtdrive.link.interrupting import interruptible
from nxtdrive.mission.body import mission_ports
from nxtdrive.mission.camera import open_mission_camera
from nxtdrive.mission.vision import camera_vision, geometric_vision
from nxtdrive.transports.sim import SimTransport
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation
from sim_backend.world.truth import TruePose
from sim_backend.world.world_file import WorldFile

SAMPLE_MS = 50


@dataclass
class Performance:
    """A mission that was performed, and what really happened.

    Attributes:
        simulation: The world afterwards.
        report: What came of it.
        records: The journal.
        lines: The console.
        track: True pose and speed every 50 ms: (time_s, pose, speed_mm_s).
    """

    simulation: Simulation
    report: Report | None = None
    records: list[Record] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    track: list[tuple[float, TruePose, float]] = field(default_factory=list)

    def of(self, kind: RecordKind, **values: object) -> list[Record]:
        """Records of a kind with these values."""
        return [r for r in self.records if r.kind is kind and all(r.data.get(k) == v for k, v in values.items())]

    def between(self, start_s: float, end_s: float) -> list[tuple[float, TruePose, float]]:
        """The track in a span of mission time."""
        return [sample for sample in self.track if start_s <= sample[0] <= end_s]

    def in_state(self, state: str) -> list[tuple[float, float]]:
        """Spans of mission time in a state."""
        spans, begun = [], None
        for record in self.of(RecordKind.TRANSITION):
            if record.data["to"] == state:
                begun = record.time_s
            elif begun is not None and record.data["to"] != state:
                spans.append((begun, record.time_s))
                begun = None
        return spans


def perform(
    world: str | WorldFile,
    mission: Mission,
    *,
    geometric: bool = False,
    faults: LinkFaults | None = None,
    interrupt_at_s: float = 0.0,
    reconnecting: bool = False,
    ask: Ask | None = None,
    arrange: Callable[[Simulation], None] = lambda _: None,
    observer: Callable[[Record], None] = lambda _: None,
    pause: Pause | None = None,
) -> Performance:
    """Run a mission in a bundled world.

    `reconnecting` is as `nxtdrive run` has it on real links; `arrange` may change the world first; `pause` is checked
    before each request.
    """
    simulation = Simulation(world, seed=1)
    arrange(simulation)
    done = Performance(simulation)
    transport = SimTransport(simulation, faults=faults)
    console = Console(done.lines.append)
    console.say("Connecting to NXT")
    with Brick(transport, reconnecting=reconnecting) as brick:
        brick.link.reconnect_timeout_s = 0.0
        vision = (
            geometric_vision(brick, mission) if geometric else camera_vision(open_mission_camera("sim", brick), mission)
        )
        make_profile = supervised(mission, ask) if ask else None
        observers = [observer, done.records.append, console]
        executive = Executive(mission, mission_ports(brick, mission, vision), observers, make_profile, pause)
        start_ms = simulation.now_ms

        def sample() -> None:
            truth = simulation.truth
            done.track.append(((simulation.now_ms - start_ms) / 1000, truth.pose, truth.speed_mm_s))
            simulation.at(simulation.now_ms + SAMPLE_MS, sample)

        simulation.at(start_ms, sample)
        if interrupt_at_s:
            simulation.at(start_ms + round(interrupt_at_s * 1000), _interrupt)
        with interruptible(brick.link, pause.check if pause else None):
            done.report = executive.run()
    simulation.advance(1000)  # whatever still moves shows
    return done


def _interrupt() -> None:
    raise KeyboardInterrupt


@pytest.fixture(name="perform")
def _perform() -> Callable[..., Performance]:
    return perform
