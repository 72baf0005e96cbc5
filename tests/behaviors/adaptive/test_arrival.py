"""The evidence of an approach is reset when its target turns out to be something else, or moves away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from staged_ports import FRAME_S, Scene, Stage, adaptive_profile

from behaviors.adaptive.approach import ApproachSkill
from behaviors.adaptive.arrival import CHECKED_FRAMES, DECIDE_S, NEEDED_CONTRADICTIONS
from behaviors.events import Event, Reason
from behaviors.ports import Glimpse, StopReason

NEAR_MM = 300.0
LEVEL, HIGH = (-70.0, 70.0), (100.0, 240.0)
"""Edges above the lens, in millimetres; the frame shows all of the high target from 652 mm on."""
OUT_OF_VIEW_DEG = 40.0
"""Beside the camera's reliable view: whether it is found there says nothing about what it is."""


class Upright(Stage):
    """A target with edges, which a robot comes nearer to.

    Args:
        scenes: What camera and sonar show; the robot touches something when the target is not found.
        edges_mm: The target's lower and upper edge above the lens.
    """

    def __init__(self, scenes: Sequence[Scene], edges_mm: tuple[float, float]) -> None:
        super().__init__(scenes)
        self._edges_mm = edges_mm
        self.driven_s: list[float] = []

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        if speed_mm_s > 0:
            self.driven_s.append(self.now())
        return StopReason.CONTACT if self._scene()[2] is None else None

    def glance(self, targets: Sequence[str]) -> Glimpse:
        glimpse = super().glance(targets)
        seen = {name: replace(each, edges_mm=self._edges_mm) for name, each in glimpse.seen.items()}
        return Glimpse(glimpse.time_s, seen)


def _approached(*scenes: Scene):
    """How an approach ends, and when."""
    return _approached_on(Stage(scenes))


def _approached_on(stage: Stage):
    skill = ApproachSkill(adaptive_profile(stage)._perception, trusts_map=False)
    while (fact := skill.call()).event is Event.CONTINUED:
        assert stage.now() < 60
    return fact, stage.now()


def test_what_is_found_steadily_in_front_of_the_robot_is_the_target():
    fact, ended_s = _approached((60.0, 0.0, NEAR_MM, None))
    assert fact.event is Event.ARRIVED
    assert ended_s < DECIDE_S


def test_the_time_in_front_of_one_candidate_does_not_count_for_another():
    elsewhere = (DECIDE_S + 1.0, 120.0, NEAR_MM, None)
    fact, _ = _approached(elsewhere, (1.2, 0.0, None, None), (60.0, 0.0, NEAR_MM, None))
    assert fact.event is Event.ARRIVED


def test_the_time_in_front_of_a_target_ends_when_the_robot_moves_off():
    stood, away = (DECIDE_S + 1.0, OUT_OF_VIEW_DEG, NEAR_MM, None), (1.0, OUT_OF_VIEW_DEG, 700.0, None)
    fact, _ = _approached(stood, away, (60.0, 0.0, NEAR_MM, None))
    assert fact.event is Event.ARRIVED


@pytest.mark.parametrize("between_mm", [700.0, None])
def test_only_contradicting_echoes_in_a_row_fail_an_arrival(between_mm):
    frames = NEEDED_CONTRADICTIONS - 1
    sure = (2.0, 0.0, NEAR_MM + 300.0, NEAR_MM + 300.0)
    contradicted = (FRAME_S * (CHECKED_FRAMES + frames), 0.0, NEAR_MM, 1500.0)
    between = [] if between_mm is None else [(1.0, 0.0, between_mm, between_mm)]
    fact, _ = _approached(sure, contradicted, *between, contradicted, (60.0, 0.0, NEAR_MM, NEAR_MM))
    assert fact.reason is (Reason.RANGE_MISMATCH if between_mm is None else Reason.WITHIN_REACH)


@pytest.mark.parametrize(("edges_mm", "stops"), [(LEVEL, False), (HIGH, True)])
def test_the_robot_stops_where_the_frame_shows_the_target_whole_until_it_is_sure(edges_mm, stops):
    jittering = [(FRAME_S, 0.0, distance_mm, None) for distance_mm in (640.0, 665.0)]
    stage = Upright([(1.5 * FRAME_S, 0.0, 640.0, None), *jittering * 10, (60.0, 0.0, 640.0, None)], edges_mm)
    _approached_on(stage)
    assert (stage.driven_s[0] > 1.0) is stops


@pytest.mark.parametrize(("edges_mm", "hides"), [(LEVEL, True), (HIGH, False)])
def test_what_is_touched_hides_the_target_only_if_the_frame_should_show_it(edges_mm, hides):
    scenes = (2.0, 0.0, 640.0, None), (1.0, 0.0, 480.0, None), (60.0, 0.0, None, None)
    fact, _ = _approached_on(Upright(scenes, edges_mm))
    assert fact.reason is Reason.BLOCKED_LONG
    assert fact.blocker.hides is hides
