"""Distances between poses."""

from __future__ import annotations

import pytest

from behaviors.ports import Pose


@pytest.mark.parametrize(
    ("heading_deg", "forward_mm"), [(0.0, 300.0), (90.0, 400.0), (180.0, -300.0), (-90.0, -400.0), (450.0, 400.0)]
)
def test_what_lies_ahead_is_measured_along_the_heading_whatever_the_other_one_is(heading_deg, forward_mm):
    begin = Pose(100.0, 200.0, heading_deg)
    there = Pose(400.0, 600.0, 33.0)
    assert begin.forward_mm_to(there) == pytest.approx(forward_mm)
    assert begin.distance_mm_to(there) == there.distance_mm_to(begin) == pytest.approx(500.0)
    assert begin.ahead(500.0, begin.polar_to(there.point)[0]) == pytest.approx(there.point)
