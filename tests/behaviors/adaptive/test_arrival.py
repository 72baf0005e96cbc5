"""What an approach believes of its target begins anew when that turns out to be something else, or moves away."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from random_ports import RandomPorts, two_targets

from behaviors.adaptive.approach import ApproachSkill
from behaviors.adaptive.arrival import N
from behaviors.events import Event, Reason
from behaviors.ports import FloorRay, Glimpse, Sighting
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue

FRAME_S = 0.1
NEAR_MM = 300.0
OUT_OF_VIEW_DEG = 40.0
"""Beside the camera's reliable view: whether it is found there says nothing about what it is."""

Scene = tuple[float, float, float | None, float | None]
"""Duration in seconds, bearing, distance of what is taken for the target (None: not found), and the sonar's echo."""


class Stage(RandomPorts):
    """A robot that stands still whatever it is told, while what it takes for its target moves.

    Args:
        scenes: What it sees and hears; the last one lasts for ever.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        super().__init__(0)
        self._scenes = list(scenes)
        self._moves, self._hinders, self._breaks = 0.0, 0.0, 0.0

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
        _, bearing_deg, distance_mm, _ = self._scene()
        if distance_mm is None or "a" not in targets:
            return Glimpse(self.now(), {})
        seen = Sighting("a", bearing_deg, distance_mm, 1.0, self.now(), (100, 80, 40, 56))
        return Glimpse(self.now(), {"a": seen})

    def free_floor(self, *, known_free: bool) -> Sequence[FloorRay]:
        return ()


def _approached(*scenes: Scene):
    """How an approach ends, and when."""
    stage, mission = Stage(scenes), two_targets()
    context = SkillContext(stage, stage, stage, mission.thesis, lambda *_, **__: None, lambda _: None)
    profile = AdaptiveProfile(context, mission, TargetQueue(mission.mission.targets))
    skill = ApproachSkill(profile._perception, trusts_map=False)
    while (fact := skill.call()).event is Event.CONTINUED:
        assert stage.now() < 60
    return fact, stage.now()


def test_what_is_found_steadily_in_front_of_the_robot_is_the_target():
    fact, ended_s = _approached((60.0, 0.0, NEAR_MM, None))
    assert fact.event is Event.ARRIVED
    assert ended_s < N.decide_s


def test_the_time_in_front_of_one_candidate_does_not_count_for_another():
    elsewhere = (N.decide_s + 1.0, 120.0, NEAR_MM, None)
    fact, _ = _approached(elsewhere, (1.2, 0.0, None, None), (60.0, 0.0, NEAR_MM, None))
    assert fact.event is Event.ARRIVED


def test_the_time_in_front_of_a_target_ends_when_the_robot_moves_off():
    stood, away = (N.decide_s + 1.0, OUT_OF_VIEW_DEG, NEAR_MM, None), (1.0, OUT_OF_VIEW_DEG, 700.0, None)
    fact, _ = _approached(stood, away, (60.0, 0.0, NEAR_MM, None))
    assert fact.event is Event.ARRIVED


@pytest.mark.parametrize("between_mm", [700.0, None])
def test_only_contradicting_echoes_in_a_row_fail_an_arrival(between_mm):
    frames = N.contradictions - 1
    sure = (2.0, 0.0, NEAR_MM + 300.0, NEAR_MM + 300.0)
    contradicted = (FRAME_S * (N.checks + frames), 0.0, NEAR_MM, 1500.0)
    between = [] if between_mm is None else [(1.0, 0.0, between_mm, between_mm)]
    fact, _ = _approached(sure, contradicted, *between, contradicted, (60.0, 0.0, NEAR_MM, NEAR_MM))
    assert fact.reason is (Reason.RANGE_MISMATCH if between_mm is None else Reason.WITHIN_REACH)
