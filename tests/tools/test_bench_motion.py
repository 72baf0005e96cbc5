"""The limits of motion that the documents state, checked against the ground truth as `nxtdrive bench` measures it."""

import math

import pytest

from nxtdrive.tools.dev.bench_motion import angle_errors, cut_motor, cut_rover, error_figures, heading_errors

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])


@pytest.mark.slow
@LINKS
def test_angles_of_any_size_at_any_speed_are_exact(latency_ms):
    middle, high = error_figures("run_angle", angle_errors(latency_ms, 30), 2.0, 5.0)
    assert middle.met
    assert high.met


@pytest.mark.slow
@LINKS
def test_turns_are_exact_and_straights_are_straight_though_the_wheels_differ(latency_ms):
    turns, drifts = heading_errors(latency_ms, 6)
    assert all(figure.met for figure in error_figures("turn", turns, 2.0, 5.0))
    assert max(map(abs, drifts)) <= 1.0


@LINKS
def test_a_cut_link_is_measured(latency_ms):
    motor, robot = cut_motor(latency_ms, 75, 0), cut_rover(latency_ms, 200, 0)
    assert 100 < motor.distance < 700
    assert 40 < robot.distance < 200
    assert 0.3 < motor.time_s < 1.5
    assert 0.3 < robot.time_s < 1.5


def test_figures_without_goals_have_no_verdict():
    middle, high = error_figures("x", [-4.0, 1.0, 2.0])
    assert (middle.value, high.value) == (2.0, 4.0)
    assert (middle.met, high.met) == (None, None)
    assert not math.isnan(high.value)
