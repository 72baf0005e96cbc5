"""What both environments share: a drawn scenario with its simulation and robot, and what its truth rewards."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from behaviors.journal import Observer
from firmware_protocol.errors import ConfigError
from nxtdrive.brick import Brick
from nxtdrive.mission import setup
from nxtdrive.simulated.robot import CAMERA, GEOMETRIC, build_robot
from nxtdrive.simulated.scenario import Scenario, draw_scenario
from nxtdrive.transports.sim import SimTransport
from sim_backend.judge import scene, stop_counts
from sim_backend.scenarios.classes import ALL_CLASSES
from sim_backend.simulation import Simulation

TUNING_SEEDS = range(20000)
"""Seeds that may be used freely; later ones are held out for reports. See docs/evaluation.md."""


class Episode:
    """One drawn mission in its simulation.

    Args:
        scenario: What is played.
        eyes: ``geometric`` or ``camera``.
        observers: Called with every record of the journal, and the episode.

    Attributes:
        reached: The targets for which the robot has stopped where a stop counts.
        robot: The ports, as every profile gets them.
    """

    def __init__(
        self, scenario: Scenario, eyes: str, observers: Callable[[Episode], Sequence[Observer]] = lambda _: ()
    ) -> None:
        self.scenario = scenario
        self.simulation = Simulation(scenario.world, seed=scenario.seed)
        self.reached: set[str] = set()
        self._closing = ExitStack()
        transport = SimTransport(
            self.simulation, latency_ms=scenario.latency_ms, faults=scenario.faults, warn_of_sleep=False
        )
        self.brick = self._closing.enter_context(Brick(transport))
        self.robot = build_robot(scenario, self.simulation, self.brick, eyes, observers(self))
        self._start_s = self.simulation.time_s

    @property
    def time_s(self) -> float:
        """Time since the start."""
        return self.simulation.time_s - self._start_s

    def arrive(self, target: str) -> bool:
        """Keep a stop for a target; returns whether it counts and is the first one to do so."""
        counts = target not in self.reached and stop_counts(self.simulation.truth.pose, scene(self.simulation), target)
        if counts:
            self.reached.add(target)
        return counts

    def close(self) -> None:
        """Stop the motors and close the brick."""
        self._closing.close()


class Drawing:
    """Draws the scenario of each episode.

    Args:
        kinds: Classes to draw from.
        seeds: Seeds to draw from.
        profile: The missions' profile.

    Raises:
        ConfigError: There is no such class, or nothing to draw from.
    """

    def __init__(self, kinds: Sequence[str], seeds: Sequence[int], profile: str) -> None:
        unknown = [kind for kind in kinds if kind not in ALL_CLASSES]
        if unknown or not kinds or not seeds:
            raise ConfigError(
                f"there is no class {unknown[0]!r}." if unknown else "there is nothing to draw an episode from.",
                remedy=f"Classes: {', '.join(ALL_CLASSES)}.",
            )
        self._kinds, self._seeds, self._profile = tuple(kinds), seeds, profile

    def draw(self, random: np.random.Generator, options: Mapping[str, Any] | None) -> Scenario:
        """Draw a scenario; the options ``kind`` and ``seed`` name one instead.

        Raises:
            ConfigError: The profile cannot be loaded.
        """
        options = options or {}
        kind = options.get("kind", self._kinds[int(random.integers(len(self._kinds)))])
        seed = options.get("seed", self._seeds[int(random.integers(len(self._seeds)))])
        scenario = draw_scenario(kind, int(seed))
        mission = setup.with_profile(scenario.mission, self._profile)
        return Scenario(kind, seed, scenario.world, mission, scenario.faults, scenario.latency_ms, scenario.sight)


def check_eyes(eyes: str) -> str:
    """Return the name of the eyes.

    Raises:
        ConfigError: There are no such eyes.
    """
    if eyes not in (GEOMETRIC, CAMERA):
        raise ConfigError(f"there are no eyes {eyes!r}.", remedy=f"Use {GEOMETRIC!r} or {CAMERA!r}.")
    return eyes
