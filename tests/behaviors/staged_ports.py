"""A robot whose camera and sonar show what a script says, for the skills of the adaptive profile."""

from __future__ import annotations

import math
from collections.abc import Sequence

from random_ports import RandomPorts, two_targets

from behaviors.mission import Mission
from behaviors.ports import CameraLost, FloorRay, Glimpse, Sighting
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue

FRAME_S = 0.1

Scene = tuple[float, float, float | None, float | None]
"""Duration in seconds, bearing, distance of what is taken for the target (None: not found), and the sonar's echo."""


class Stage(RandomPorts):
    """A robot that turns but does not drive, while what it takes for its target moves.

    Args:
        scenes: What camera and sonar show; the last one lasts for ever.
        blind_s: When the camera begins to give no pictures, and when it gives some again.
    """

    def __init__(self, scenes: Sequence[Scene], blind_s: tuple[float, float] = (math.inf, math.inf)) -> None:
        super().__init__(0)
        self._scenes, self._blind_s = list(scenes), blind_s
        self._hinders = self._breaks = 0.0

    def _scene(self) -> Scene:
        left_s = self.now()
        for scene in self._scenes:
            left_s -= scene[0]
            if left_s < 0:
                break
        return scene

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> None:
        pass

    def range_mm(self) -> float | None:
        return self._scene()[3]

    def glance(self, targets: Sequence[str]) -> Glimpse:
        self.sleep(FRAME_S)
        if self._blind_s[0] <= self.now() < self._blind_s[1]:
            raise CameraLost("no picture")
        _, bearing_deg, distance_mm, _ = self._scene()
        if distance_mm is None or "a" not in targets:
            return Glimpse(self.now(), {})
        seen = Sighting("a", bearing_deg, distance_mm, 1.0, self.now(), (100, 80, 40, 56))
        return Glimpse(self.now(), {"a": seen})

    def free_floor(self, free_at_s: float | None) -> Sequence[FloorRay]:
        return ()


def adaptive_profile(stage: Stage, mission: Mission | None = None) -> AdaptiveProfile:
    """Return a profile on that robot."""
    mission = mission or two_targets()
    context = SkillContext(stage, stage, stage, mission.thesis, lambda *_, **__: None, lambda _: None)
    return AdaptiveProfile(context, mission, TargetQueue(mission.mission.targets))
