"""An environment that drives: an action is the speed of the two wheels until the camera's next frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import cv2
import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from behaviors.angles import wrapped_deg
from behaviors.ports import Outage, Sighting
from behaviors.profile_names import ADAPTIVE
from nxtdrive.gym.scenario_sampler import TUNING_SEEDS, ScenarioSampler, check_cost, check_vision, episode_info
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.robot import GEOMETRIC

IMAGE = (320, 240)
"""Width and height of an ``image``."""
TARGETS = 6
"""Rows of the observation's ``targets``: as many as the largest class of scenarios has."""
FASTEST_MM_S = 300.0
"""Speed of a wheel at an action of 1."""
DEAD_ZONE = 0.05
"""Actions nearer to 0 let the robot stand; where a stop counts, that is an arrival."""
STEP_MS = 100
"""A step during an outage takes this long."""
NO_ECHO_MM = 2550.0
FARTHEST_MM = 20000.0
Observation = dict[str, Any]


class WheelEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Drives the wheels of a robot until it has stopped at every target.

    An action is the speed of the left and of the right wheel, -1 to 1 of `FASTEST_MM_S` (values beyond count as the
    nearest of these), until the next frame of the camera; the safety stop of the mission's robot stays on. Each target
    at which the robot stands where a stop counts is worth 1, once and in any order; each second costs ``cost_per_s``.
    An episode is terminated when all targets are reached, and truncated when the mission's time is up.

    The observation has ``sonar`` (mm, 2550 without an echo), ``bumper``, ``odometry`` (x and y in mm, heading in
    degrees, positive right, from the start), ``targets`` (for each in order: whether it is yet to be reached, and with
    geometric vision whether it is seen, its bearing in degrees and its distance in mm), ``left_s``, and with
    ``vision="camera"`` the ``image``, blue, green, red.

    Args:
        kinds: Classes of scenarios, drawn from for each episode; see docs/evaluation.md.
        seeds: Seeds, drawn from likewise.
        vision: How targets are seen: ``geometric`` or ``camera``.
        cost_per_s: Reward that each second costs; 0.01 makes a target worth 100 s.

    Raises:
        ConfigError: An argument names nothing that exists.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as its base declares

    def __init__(
        self,
        kinds: Sequence[str] = ("open",),
        seeds: Sequence[int] = TUNING_SEEDS,
        vision: str = GEOMETRIC,
        cost_per_s: float = 1.0,
    ) -> None:
        self._scenarios, self._cost_per_s = ScenarioSampler(kinds, seeds, ADAPTIVE), check_cost(cost_per_s)
        self._renders = check_vision(vision) != GEOMETRIC
        self._episode: Episode | None = None
        self._ended = False
        self._standing = False
        low = np.tile(np.array([0, 0, -180, 0], np.float32), (TARGETS, 1))
        high = np.tile(np.array([1, 1, 180, FARTHEST_MM], np.float32), (TARGETS, 1))
        far = np.array([FARTHEST_MM, FARTHEST_MM, 180], np.float32)
        parts: dict[str, spaces.Space[Any]] = {
            "sonar": spaces.Box(0.0, NO_ECHO_MM, (1,), np.float32),
            "bumper": spaces.Discrete(2),
            "odometry": spaces.Box(-far, far),
            "targets": spaces.Box(low, high),
            "left_s": spaces.Box(0.0, 1000.0, (1,), np.float32),
        }
        if self._renders:
            parts["image"] = spaces.Box(0, 255, (*IMAGE[::-1], 3), np.uint8)
        self.observation_space = spaces.Dict(parts)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Determines all episodes from here on.
            options: ``kind`` and ``seed`` name a scenario instead of drawing one.
        """
        super().reset(seed=seed, options=options)
        self.close()
        self._standing = self._ended = False
        # also for images: the robot's frames come at the same times, and no detector searches them
        self._episode = Episode(self._scenarios.sample(self.np_random, options), GEOMETRIC)
        return self._observe(self._episode), episode_info(self._episode)

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive until the next frame.

        Raises:
            InvalidAction: The action is not two finite numbers.
            ResetNeeded: No episode has begun, or it has ended.
        """
        if (episode := self._episode) is None or self._ended:
            raise gymnasium.error.ResetNeeded("reset() begins an episode.")
        before_s, reached = episode.time_s, len(episode.reached)
        left, right = _wheels(action)
        stands = max(abs(left), abs(right)) < DEAD_ZONE
        if stands and self._standing:  # one step to come to rest
            for target in self._targets(episode):
                episode.arrive(target)
        self._standing = stands
        with suppress(Outage):
            self._drive(episode, 0.0 if stands else left, 0.0 if stands else right)
        observation = self._observe(episode)
        done = episode.reached.keys() >= set(self._targets(episode))
        late = not done and episode.time_s >= self._limit_s(episode)
        self._ended = done or late
        reward = len(episode.reached) - reached - self._cost_per_s * (episode.time_s - before_s)
        return observation, reward, done, late, episode_info(episode)

    def close(self) -> None:
        """Stop the motors and close the simulated brick."""
        if self._episode is not None:
            self._episode.close()
        self._episode = None

    def _drive(self, episode: Episode, left: float, right: float) -> None:
        track_mm = episode.scenario.mission.robot.axle_track_mm
        turn_deg_s = math.degrees((left - right) * FASTEST_MM_S / track_mm)
        episode.robot.ports.body.drive((left + right) / 2 * FASTEST_MM_S, turn_deg_s)

    def _observe(self, episode: Episode) -> Observation:
        """Wait for the next frame and return the robot's measurements; during an outage there are none."""
        began_s, robot, names = episode.time_s, episode.robot.ports, self._targets(episode)
        seen: dict[str, Sighting] = {}
        with suppress(Outage):
            seen = dict(robot.vision.glance(names).seen)
        sonar, bumper, odometry = NO_ECHO_MM, 0, np.zeros(3, np.float32)
        with suppress(Outage):
            pose = robot.body.pose()
            odometry = np.array([pose.x_mm, pose.y_mm, wrapped_deg(pose.heading_deg)], np.float32)
            odometry[:2] = np.clip(odometry[:2], -FARTHEST_MM, FARTHEST_MM)
            echo_mm, touches = robot.body.range_mm(), robot.body.touching()
            sonar, bumper = min(NO_ECHO_MM if echo_mm is None else max(echo_mm, 0.0), NO_ECHO_MM), int(touches)
        if episode.time_s == began_s:
            episode.simulation.advance(STEP_MS)
        observation = {
            "sonar": np.array([sonar], np.float32),
            "bumper": np.int64(bumper),
            "odometry": odometry,
            "targets": self._rows(episode, seen),
            "left_s": np.array([max(0.0, min(1000.0, self._limit_s(episode) - episode.time_s))], np.float32),
        }
        if self._renders:
            image = episode.simulation.camera_frame()
            observation["image"] = np.zeros((*IMAGE[::-1], 3), np.uint8) if image is None else cv2.resize(image, IMAGE)
        return observation

    def _rows(self, episode: Episode, seen: dict[str, Sighting]) -> NDArray[np.float32]:
        rows = np.zeros((TARGETS, 4), np.float32)
        for row, target in zip(rows, self._targets(episode), strict=False):
            row[0] = target not in episode.reached
            if not self._renders and (sighting := seen.get(target)):
                row[1:] = 1.0, sighting.bearing_deg, min(sighting.distance_mm, FARTHEST_MM)
        return rows

    @staticmethod
    def _targets(episode: Episode) -> list[str]:
        return list(episode.scenario.mission.mission.targets)

    @staticmethod
    def _limit_s(episode: Episode) -> float:
        return float(episode.scenario.mission.mission.time_limit_s)


def _wheels(action: NDArray[np.float32]) -> tuple[float, float]:
    """Return the speeds of an action, within its limits."""
    try:
        speeds = np.asarray(action).astype(np.float64, casting="same_kind")
    except (ValueError, TypeError):
        speeds = np.empty(0)
    if speeds.shape != (2,) or not np.isfinite(speeds).all():
        raise gymnasium.error.InvalidAction(f"an action is two finite numbers, not {action!r}.")
    left, right = np.clip(speeds, -1.0, 1.0)
    return float(left), float(right)
