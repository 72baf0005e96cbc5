"""An episode: one mission in one scenario, from its start to its end, as in Gymnasium."""

from __future__ import annotations

from contextlib import ExitStack

from behaviors.journal import Observer, Record, RecordKind
from nxtdrive.brick import Brick
from nxtdrive.simulated.robot import scenario_robot
from nxtdrive.simulated.scenario import Scenario
from nxtdrive.transports.sim import SimTransport
from sim_backend.evaluation import scene, stop_counts
from sim_backend.simulation import Simulation


class Episode:
    """A mission in its simulation, with its robot and the targets reached by the ground truth.

    Args:
        scenario: The scenario.
        vision: How targets are seen: ``geometric`` or ``camera``.

    Attributes:
        scenario: As given.
        simulation: Its world and brick; a profile has no access to it.
        observers: Called with every record of the journal.
        reached: When the robot stopped where a stop counts, for each target for which it did, seconds from the start.
        robot: The ports, as every profile gets them.
    """

    def __init__(self, scenario: Scenario, vision: str) -> None:
        self.scenario = scenario
        self.simulation = Simulation(scenario.world, seed=scenario.seed)
        self.observers: list[Observer] = []
        self.reached: dict[str, float] = {}
        self._closing = ExitStack()
        conditions = scenario.conditions
        transport = SimTransport(
            self.simulation, latency_ms=conditions.latency_ms, faults=conditions.faults, warn_of_sleep=False
        )
        brick = self._closing.enter_context(Brick(transport))
        self.robot = scenario_robot(scenario, self.simulation, brick, vision, self.observers)
        self._start_s = self.simulation.time_s

    @property
    def time_s(self) -> float:
        """Time since the start."""
        return self.simulation.time_s - self._start_s

    def arrive(self, target: str) -> None:
        """Keep the first stop for a target that counts."""
        if target not in self.reached and stop_counts(self.simulation.truth.pose, scene(self.simulation), target):
            self.reached[target] = self.time_s

    def note_arrival(self, record: Record) -> None:
        """Check each stop against the ground truth at that moment; an observer of the journal."""
        if record.kind is RecordKind.TRANSITION and record.data["to"] == "reached":
            self.arrive(record.target)

    def close(self) -> None:
        """Stop the motors and close the brick."""
        self._closing.close()
