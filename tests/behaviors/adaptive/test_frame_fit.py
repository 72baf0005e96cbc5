"""What the frame shows of a target at a height, compared with where a camera's pixels see its edges."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.frame_fit import FILLS_SHARE, FrameFit
from behaviors.mission.robot import CameraTable
from nxtdrive.vision.geometry import Mounting, Pinhole

ROWS = 240
cameras = st.builds(CameraTable, hfov_deg=st.floats(40, 90), tilt_deg=st.floats(-15, 15))
distances_mm = st.floats(200, 3000)
edges_mm = st.tuples(st.floats(-400, 400), st.floats(50, 400)).map(lambda drawn: (drawn[0], drawn[0] + drawn[1]))


def _rows_that_see(camera: CameraTable, lower_mm: float, upper_mm: float, distance_mm: float) -> int:
    """Count the rows in the middle of the frame whose rays end on an upright strip between two heights."""
    pinhole = Pinhole.from_hfov(320, camera.hfov_deg, Mounting(tilt_deg=camera.tilt_deg))
    _, below_deg = pinhole.directions(np.full(ROWS, 160.0), np.arange(ROWS) + 0.5)
    heights_mm = -distance_mm * np.tan(np.radians(below_deg))
    return int(((heights_mm >= lower_mm) & (heights_mm <= upper_mm)).sum())


@given(cameras, edges_mm, distances_mm)
def test_a_target_is_shown_if_pixels_see_it(camera, edges, distance_mm):
    shown = FrameFit(camera).shown(edges, distance_mm)
    a_row_mm = 2.5 * distance_mm / ROWS  # of the widest view that is drawn, and near its edge
    assert (_rows_that_see(camera, *edges, distance_mm) > 0) is (shown > 0) or shown * (edges[1] - edges[0]) < a_row_mm


@given(cameras, edges_mm, distances_mm)
def test_farther_away_the_frame_shows_more_until_it_shows_the_target_whole(camera, edges, distance_mm):
    fit = FrameFit(camera)
    fills_mm = fit.fills_mm(edges)
    assert fit.shown(edges, max(distance_mm, fills_mm)) == pytest.approx(1.0)
    assert fit.shown(edges, distance_mm) <= fit.shown(edges, 1.2 * distance_mm) + 1e-9
    if fills_mm > 0:
        assert fit.shown(edges, 0.98 * FILLS_SHARE * fills_mm) < 1.0


def test_what_is_below_a_raised_view_never_fits_in():
    raised = FrameFit(CameraTable(tilt_deg=30))
    assert math.isinf(raised.fills_mm((-200.0, -100.0)))
    assert raised.shown((-200.0, -100.0), 2000.0) == 0.0
