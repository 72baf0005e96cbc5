"""Odometry and wheel geometry by themselves: what the wheels count is the motion that they make."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.ports import Pose
from firmware_protocol.errors import LocalProtocolError
from nxtdrive.motion.odometry import Odometry
from nxtdrive.motion.outputs import Sample
from nxtdrive.motion.wheel_geometry import WheelGeometry, mm_per_degree

DIAMETER_MM, TRACK_MM = 56.0, 112.0
"""One turn of one wheel turns the robot by a right angle around the other."""
STEP_DEG = 1
LINK = object()


def geometry(**others):
    return WheelGeometry.of(DIAMETER_MM, TRACK_MM, **{"reversed": False, **others})


def reading(left_deg, right_deg, time_s, link=LINK):
    return Sample((left_deg, right_deg), time_s, 0.002, link)


def drive(odometry, *legs):
    """Let the wheels turn by some degrees, one leg after the other, in small steps."""
    left, right, time_s = (*odometry.last.angles_deg, odometry.last.time_s) if odometry.last else (0, 0, 0.0)
    odometry.update(reading(left, right, time_s))
    for left_deg, right_deg in legs:
        steps = max(abs(left_deg), abs(right_deg)) // STEP_DEG
        for i in range(1, steps + 1):
            time_s += 0.01
            odometry.update(reading(left + left_deg * i / steps, right + right_deg * i / steps, time_s))
        left, right = left + left_deg, right + right_deg


def driven(*legs, wheels=None):
    odometry = Odometry(wheels or geometry())
    drive(odometry, *legs)
    return odometry


def values(pose):
    return pose.x_mm, pose.y_mm, pose.heading_deg


@pytest.mark.parametrize(
    ("wheels_deg", "pose"),
    [
        ((360, 360), (math.pi * DIAMETER_MM, 0, 0)),
        ((-360, -360), (-math.pi * DIAMETER_MM, 0, 0)),
        ((360, -360), (0, 0, 180)),
        ((360, 0), (56, 56, 90)),
        ((0, 360), (56, -56, -90)),
        ((-360, 0), (-56, 56, -90)),
        ((0, -360), (-56, -56, 90)),
        ((720, 0), (0, 112, 180)),
    ],
)
def test_the_robot_turns_around_the_wheel_that_stands(wheels_deg, pose):
    assert values(driven(wheels_deg).pose) == pytest.approx(pose, abs=0.1)


def test_a_square_leads_back_and_its_sides_add_up():
    side, corner = (720, 720), (180, -180)
    odometry = driven(*[side, corner] * 4)
    around_mm = 4 * 2 * math.pi * DIAMETER_MM
    assert values(odometry.pose) == pytest.approx((0, 0, 360), abs=0.1)
    assert odometry.distance_mm == pytest.approx(around_mm)
    moved = odometry.since_correction
    assert (moved.x_mm, moved.y_mm, moved.turned_deg) == pytest.approx((0, 0, 360), abs=0.1)
    assert moved.driven_mm == pytest.approx(around_mm)


def test_the_way_back_counts_negative_as_a_distance_and_positive_as_a_path():
    odometry = driven((720, 720), (-360, -360))
    turn_mm = math.pi * DIAMETER_MM
    assert odometry.distance_mm == pytest.approx(turn_mm)
    assert odometry.since_correction.driven_mm == pytest.approx(3 * turn_mm)
    assert odometry.since_correction.away_mm == pytest.approx(turn_mm)


def test_a_correction_turns_the_robot_where_it_is_and_begins_a_new_stretch():
    odometry = driven((360, 0))
    odometry.correct(-30.0)
    assert values(odometry.pose) == pytest.approx((56, 56, 60), abs=0.1)
    assert odometry.since_correction.away_mm == odometry.since_correction.turned_deg == 0.0
    odometry.set_pose(Pose(0.0, 0.0, 200.0))
    assert odometry.turned_deg == pytest.approx(60.0), "a pose that is set is not a turn"
    drive(odometry, (180, 180), (0, 360))
    moved = odometry.since_correction
    assert odometry.turned_deg == pytest.approx(-30.0)
    assert moved.turned_deg == pytest.approx(-90.0)
    assert (moved.x_mm, moved.y_mm) == pytest.approx((odometry.pose.x_mm, odometry.pose.y_mm))
    assert moved.away_mm == pytest.approx(math.hypot(math.pi * 28 + 56, 56), abs=0.1)


@given(
    st.floats(-1000, 1000), st.floats(-720, 720), st.floats(-20, 20), st.floats(-20, 50), st.booleans(), st.booleans()
)
def test_wheels_that_turn_as_far_as_a_motion_needs_count_it(distance_mm, turn_deg, mismatch, slip, left, right):
    wheels = geometry(reversed=(left, right), mismatch_percent=mismatch, turn_slip_percent=slip)
    odometry = Odometry(wheels)
    odometry.update(reading(0, 0, 0.0))
    left_deg, right_deg = wheels.wheels_deg(distance_mm, turn_deg)
    odometry.update(reading(-left_deg if left else left_deg, -right_deg if right else right_deg, 10.0))
    assert odometry.distance_mm == pytest.approx(distance_mm, abs=1e-6)
    assert odometry.turned_deg == pytest.approx(turn_deg, abs=1e-6)


def test_the_mean_of_both_wheels_has_the_diameter_and_the_right_one_is_larger_by_the_mismatch():
    assert mm_per_degree(2 * 360 / math.pi, 4.0) == pytest.approx((1.96, 2.04))


@pytest.mark.parametrize(("slip_percent", "turned_deg"), [(0, 90), (20, 72), (50, 45), (-20, 108)])
def test_slip_is_the_share_of_a_turn_that_is_lost(slip_percent, turned_deg):
    assert driven((180, -180), wheels=geometry(turn_slip_percent=slip_percent)).turned_deg == pytest.approx(turned_deg)


@pytest.mark.parametrize(("name", "least", "most"), [("mismatch_percent", -20, 20), ("turn_slip_percent", -20, 50)])
def test_percentages_are_refused_from_the_end_of_their_range_on(name, least, most):
    for inside in (least, most):
        geometry(**{name: inside})
    for outside in (least - 0.5, most + 0.5):
        with pytest.raises(LocalProtocolError, match=f"{name} must be from {least} to {most}"):
            geometry(**{name: outside})


def test_a_reading_that_arrives_after_a_later_one_is_not_used():
    odometry = driven((90, 90))
    before = odometry.pose
    assert not odometry.update(reading(0, 0, odometry.last.time_s - 0.005))
    assert odometry.pose == before
    assert odometry.update(reading(90, 90, odometry.last.time_s))


def test_wheels_rest_since_the_first_of_equal_readings():
    odometry = Odometry(geometry())
    assert odometry.rest_s == 0.0
    for time_s, count, rest_s in [(1.0, 0, 0.0), (1.5, 0, 0.5), (2.0, 5, 0.0), (2.25, 5, 0.25), (3.0, 5, 1.0)]:
        odometry.update(reading(count, 0, time_s))
        assert odometry.rest_s == pytest.approx(rest_s)


@pytest.mark.parametrize(
    ("begin", "end", "after_s", "same_link", "counted"),
    [
        ((0, 0), (1000, 1000), 1.0, True, True),  # full speed
        ((0, 0), (2000, 2000), 1.0, True, False),
        ((0, 0), (-2000, 10), 1.0, True, False),
        ((0, 0), (5000, 5000), 5.0, True, True),
        ((0, 0), (5000, 5000), 5.0, False, False),  # while the link was lost, the wheels turned for one lease
        ((0, 0), (300, 300), 5.0, False, True),
        ((-20, -20), (0, 0), 5.0, True, False),  # back to where the counters begin
        ((-2, -2), (0, 0), 5.0, True, True),
        ((-20, -20), (0, -40), 5.0, True, True),
    ],
)
def test_counters_that_jump_are_not_motion(begin, end, after_s, same_link, counted):
    odometry = Odometry(geometry())
    odometry.update(reading(*begin, 100.0))
    before = odometry.pose
    odometry.update(reading(*end, 100.0 + after_s, LINK if same_link else object()))
    assert (odometry.pose != before) == counted
    assert odometry.last.angles_deg == end
