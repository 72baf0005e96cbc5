"""Floor in a frame counts as free once the robot has driven straight over it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.driven_floor import FLOOR_MM, DrivenFloor
from behaviors.ports import Pose


def drive(floor, *x_mm, heading_deg=0.0):
    """Add a frame at each of these places, one per second; return the answers."""
    return [floor.add(float(second), Pose(each, 0.0, heading_deg)) for second, each in enumerate(x_mm)]


def test_a_frame_shows_free_floor_once_the_robot_has_driven_over_it():
    assert drive(DrivenFloor(), 0.0, 300.0, 600.0, 900.0, 1200.0) == [None, None, None, 0.0, 1.0]


def test_what_a_robot_that_turned_saw_before_is_not_where_it_drove():
    floor = DrivenFloor()
    drive(floor, 0.0, 300.0, 600.0)
    assert drive(floor, 900.0, heading_deg=20.0) == [None]
    assert drive(floor, 1500.0, heading_deg=20.0) == [None]
    assert drive(floor, 1700.0, heading_deg=20.0) == [0.0]


def test_a_robot_that_backed_off_had_met_something():
    assert drive(DrivenFloor(), 0.0, 300.0, 600.0, 500.0, 900.0, 1190.0, 1200.0)[-3:] == [None, None, 3.0]


def test_a_robot_that_drives_backwards_does_not_drive_over_what_it_sees():
    assert drive(DrivenFloor(), 0.0, -400.0, -800.0, -1200.0) == [None] * 4


@given(st.lists(st.tuples(st.floats(-300.0, 300.0), st.floats(-30.0, 30.0)), max_size=60))
def test_a_frame_is_from_so_far_behind_and_from_about_the_same_heading(motions):
    floor, pose, poses = DrivenFloor(), Pose(), []
    for second, (forward_mm, turned_deg) in enumerate(motions):
        pose = Pose(*pose.ahead(forward_mm), pose.heading_deg + turned_deg)
        poses.append(pose)
        free_at_s = floor.add(float(second), pose)
        if free_at_s is not None:
            then = poses[int(free_at_s)]
            assert then.polar_to((pose.x_mm, pose.y_mm))[1] >= FLOOR_MM
            assert abs(pose.heading_deg - then.heading_deg) < 6.0
