"""What an approach believes of its target begins anew when that turns out to be something else, or moves away."""

from __future__ import annotations

import pytest
from staged_ports import FRAME_S, Scene, Stage, adaptive_profile

from behaviors.adaptive.approach import ApproachSkill
from behaviors.adaptive.arrival import N
from behaviors.events import Event, Reason

NEAR_MM = 300.0
OUT_OF_VIEW_DEG = 40.0
"""Beside the camera's reliable view: whether it is found there says nothing about what it is."""


def _approached(*scenes: Scene):
    """How an approach ends, and when."""
    stage = Stage(scenes)
    skill = ApproachSkill(adaptive_profile(stage)._perception, trusts_map=False)
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
