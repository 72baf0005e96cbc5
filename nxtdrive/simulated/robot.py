"""Build the robot of a scenario: `MissionBody` and vision on a simulation, degraded as the scenario demands.

A profile gets a `ScenarioRobot` and nothing else; it has no access to the simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

import numpy as np
from numpy.typing import NDArray

from behaviors.journal import Observer
from behaviors.mission import Mission
from behaviors.ports import Ports
from nxtdrive.brick import Brick
from nxtdrive.mission.body import mission_ports
from nxtdrive.mission.camera import SIMULATED, open_mission_camera
from nxtdrive.mission.vision import mission_vision
from nxtdrive.simulated.scenario import Scenario
from sim_backend.camera.geometric import Quad
from sim_backend.scenarios.conditions import CameraLoss, ViewConditions
from sim_backend.simulation import Simulation

GEOMETRIC, CAMERA = "geometric", "camera"
"""Vision without rendering and detection, and vision with both."""

LOOK_MS = 100
"""How often the triggers of the camera's losses are checked."""


@dataclass(frozen=True, slots=True)
class ScenarioRobot:
    """The robot of one scenario, and its mission.

    Attributes:
        mission: The mission.
        ports: Motors and sensors, the camera, and mission time.
        observers: Called with every record of the journal.
    """

    mission: Mission
    ports: Ports
    observers: Sequence[Observer]


def scenario_robot(
    scenario: Scenario, simulation: Simulation, brick: Brick, vision: str, observers: Sequence[Observer]
) -> ScenarioRobot:
    """Build the robot of a scenario.

    Args:
        scenario: The mission, and the camera's outages.
        simulation: The world that it drives in.
        brick: The open connection to its brick.
        vision: How targets are seen: ``geometric`` or ``camera``.
        observers: Called with every record of the journal.
    """
    view = scenario.conditions.view
    sensor = DegradedSensor(simulation, view, scenario.seed) if vision == GEOMETRIC else None
    sees = mission_vision(scenario.mission, brick, open_mission_camera(SIMULATED, brick), SIMULATED, sensor)
    for loss in view.losses:
        _lose_camera(simulation, loss)
    return ScenarioRobot(scenario.mission, mission_ports(brick, scenario.mission, sees), observers)


class DegradedSensor:
    """A geometric sensor degraded by poor light and look-alikes; see `nxtdrive.vision.target_vision.GeometricSensor`.

    Args:
        simulation: The simulation whose webcam is queried.
        view: How the view is degraded.
        seed: Seeds its misses and mistakes.
    """

    def __init__(self, simulation: Simulation, view: ViewConditions, seed: int) -> None:
        self._webcam = webcam = simulation.webcam
        self.fps, self.size, self.detector_s = webcam.fps, webcam.size, webcam.detector_s
        self._view = view
        self._random = Random(f"{seed}/sight")
        simulation.generators.append(self._random)

    @property
    def unplugged(self) -> bool:
        """Whether the camera delivers no frames now."""
        return self._webcam.unplugged

    @property
    def dropped(self) -> bool:
        """Whether the latest frame never arrives."""
        return self._webcam.dropped

    def observe(self, name: str) -> Quad | None:
        """Return the target, or a look-alike mistaken for it, in the latest frame."""
        view = self._view
        seen = self._webcam.observe(name, farthest_mm=view.farthest_mm)
        if seen is not None and self._random.random() < view.hit_rate:
            return seen
        found = (self._webcam.observe(lookalike) for lookalike in self._mistaken())
        return next((taken for taken in found if taken is not None), None)

    def floor_ends(self) -> NDArray[np.float64]:
        """Return the pixels at which the floor ends in the latest frame."""
        return self._webcam.floor_ends()

    def turned_deg(self) -> float | None:
        """Return how far the camera turned since the frame of the last call, as the latest frame shows it."""
        return self._webcam.turned_deg()

    def _mistaken(self) -> tuple[str, ...]:
        """Draw which look-alikes are mistaken for the target in this frame, if it shows them."""
        view = self._view
        if view.mistake_rates:
            draws = zip(view.lookalikes, view.mistake_rates, strict=True)
            return tuple(lookalike for lookalike, rate in draws if self._random.random() < rate)
        # one draw per frame: more look-alikes do not cause more mistakes
        return view.lookalikes if view.lookalikes and self._random.random() < view.mistake_rate else ()


def _lose_camera(simulation: Simulation, loss: CameraLoss) -> None:
    """Unplug the camera once the target has been in view long enough."""
    seen_ms = 0

    def look() -> None:
        nonlocal seen_ms
        now_ms = simulation.now_ms
        seen_ms += LOOK_MS * simulation.truth.in_view(loss.target)
        if seen_ms >= loss.after_s * 1000:
            webcam = simulation.webcam
            webcam.unplugged_ms = (*webcam.unplugged_ms, (now_ms, now_ms + round(loss.lasts_s * 1000)))
        else:
            simulation.at(now_ms + LOOK_MS, look)

    simulation.at(simulation.now_ms, look)
