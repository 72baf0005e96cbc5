"""The error of distances by apparent size, learned from echoes and from how a target grows in the frame."""

from dataclasses import replace
from random import Random

import pytest

from behaviors.adaptive.camera_scale import CameraScale
from behaviors.ports import Cut, Pose, Sighting

ARRIVE_MM, AHEAD_MM = 420.0, 40.0
FACTORS = (0.82, 0.9, 1.0, 1.1, 1.22)


def _sighting(distance_mm, target="door", bearing_deg=0.0):
    return Sighting(target, bearing_deg, distance_mm, 1.0, 0.0, (100, 80, 40, 56))


def _approach(scale, factor, wheels=1.0, echo_offset_mm=0.0, *, echoes=True, seed=0, target="door"):
    """Drive straight from 2 m to 0.4 m; what gives the echo stands at an offset from the target."""
    random = Random(seed)
    for i in range(100):
        true_mm = 2000.0 - 16.0 * i
        echo_mm = true_mm + echo_offset_mm - AHEAD_MM + random.gauss(0.0, 10.0)
        seen_mm = true_mm / factor * random.gauss(1.0, 0.015)
        pose = Pose(16.0 * i * wheels)
        scale.learn(_sighting(seen_mm, target), pose, echo_mm if echoes and echo_mm > 30.0 else None)


def _factor(scale, target="door"):
    return scale.corrected(_sighting(1000.0, target)).distance_mm / 1000.0


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("wheels", [0.93, 1.0, 1.07])
@pytest.mark.parametrize("seed", range(3))
def test_a_wrong_camera_is_learned_in_one_approach(factor, wheels, seed):
    scale = CameraScale(AHEAD_MM)
    _approach(scale, factor, wheels, seed=seed)
    assert _factor(scale) == pytest.approx(factor, rel=0.13)
    assert scale.assured_mm("door", ARRIVE_MM) * factor / _factor(scale) <= 1.15 * ARRIVE_MM


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("seed", range(3))
def test_without_a_sonar_the_growth_of_the_picture_decides(factor, seed):
    scale = CameraScale(AHEAD_MM)
    _approach(scale, factor, echoes=False, seed=seed)
    assert _factor(scale) == pytest.approx(factor, rel=0.1)
    assert scale.assured_mm("door", ARRIVE_MM) * factor / _factor(scale) <= 1.15 * ARRIVE_MM


def test_the_next_target_begins_with_what_was_learned():
    scale = CameraScale(AHEAD_MM)
    _approach(scale, 1.2)
    assert _factor(scale, "window") == _factor(scale)
    assert scale.assured_mm("window", ARRIVE_MM) > 0.9 * ARRIVE_MM


@pytest.mark.parametrize("offset_mm", [-350.0, -250.0, 300.0, 600.0])
def test_echoes_of_something_else_do_not_make_a_right_camera_wrong(offset_mm):
    scale = CameraScale(AHEAD_MM)
    _approach(scale, 1.0, echo_offset_mm=offset_mm)
    assert _factor(scale) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("stuck_mm", [260.0, 310.0, 500.0])
def test_a_sonar_that_repeats_an_echo_does_not_make_a_right_camera_wrong(stuck_mm):
    scale = CameraScale(AHEAD_MM)
    for i in range(100):
        scale.learn(_sighting(2000.0 - 16.0 * i), Pose(16.0 * i), stuck_mm)
    assert _factor(scale) == pytest.approx(1.0, abs=0.1)


def test_a_box_beside_the_way_does_not_make_a_right_camera_wrong():
    """As the robot passes it, its echo comes nearer by less than half of what is driven."""
    scale = CameraScale(AHEAD_MM)
    for i in range(30):
        scale.learn(_sighting(1000.0 - 16.0 * i), Pose(16.0 * i), 520.0 - 7.0 * i)
    assert _factor(scale) == pytest.approx(1.0, abs=0.1)


def test_an_echo_to_the_side_is_ignored_and_before_anything_is_measured_the_robot_goes_nearer():
    scale = CameraScale(AHEAD_MM)
    scale.learn(_sighting(800.0, bearing_deg=20.0), Pose(), 400.0)
    assert _factor(scale) == 1.0
    assert 0.8 * ARRIVE_MM < scale.assured_mm("door", ARRIVE_MM) < ARRIVE_MM


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("wheels", [0.92, 1.08])
def test_where_no_echo_confirms_a_stop_the_robot_goes_nearer_by_as_much_as_wheels_may_be_wrong(factor, wheels):
    scale = CameraScale(AHEAD_MM)
    for target in ("door", "window"):
        _approach(scale, factor, wheels, echoes=False, target=target)
        unconfirmed_mm = scale.assured_mm(target, ARRIVE_MM, confirmed=False)
        assert unconfirmed_mm < scale.assured_mm(target, ARRIVE_MM)
        assert unconfirmed_mm * factor / _factor(scale, target) <= 1.08 * ARRIVE_MM


def test_nothing_is_learned_from_a_target_that_is_cut_off():
    scale = CameraScale(AHEAD_MM)
    for i in range(60):
        seen = replace(_sighting(400.0 + 3.0 * i), cut=Cut.BOTTOM)
        scale.learn(seen, Pose(5.0 * i), 500.0 - 5.0 * i)
    assert _factor(scale) == 1.0
