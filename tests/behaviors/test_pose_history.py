"""Recent poses, to look up where a frame was taken."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.ports import Pose
from behaviors.pose_history import PoseHistory


@given(rate_deg_s=st.floats(-120.0, 120.0), bearing_deg=st.floats(-180.0, 180.0))
def test_poses_between_those_that_are_known_are_interpolated(rate_deg_s, bearing_deg):
    poses = PoseHistory()
    for i in range(8):
        poses.add(i * 0.2, Pose(i * 40.0, -i * 10.0, bearing_deg + rate_deg_s * i * 0.2))
    for time_s in (0.0, 0.05, 0.33, 0.6, 1.2, 1.4):
        pose = poses.at(time_s)
        assert pose.x_mm == pytest.approx(200.0 * time_s)
        assert pose.y_mm == pytest.approx(-50.0 * time_s)
        assert pose.heading_deg == pytest.approx(bearing_deg + rate_deg_s * time_s)


def test_before_and_after_them_the_nearest_counts():
    poses = PoseHistory()
    poses.add(5.0, Pose(1.0))
    poses.add(6.0, Pose(2.0))
    assert poses.at(4.0) == Pose(1.0)
    assert poses.at(7.0) == Pose(2.0)


def test_only_the_last_seconds_are_kept():
    poses = PoseHistory()
    for time_s in range(100):
        poses.add(float(time_s), Pose(float(time_s)))
    assert poses.at(0.0).x_mm > 90.0
    assert poses.at(98.5).x_mm == 98.5
