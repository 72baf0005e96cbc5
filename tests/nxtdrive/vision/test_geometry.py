import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, box_of, overlap
from nxtdrive.vision.geometry import Pinhole, crossing, focal_from

widths = st.integers(160, 1920)
views = st.floats(20, 120)
heights = st.floats(10, 2000)
distances = st.floats(100, 10_000)
bearings = st.floats(-50, 50)


@given(widths, views)
def test_the_edges_of_the_frame_lie_at_half_the_view(width, hfov_deg):
    pinhole = Pinhole.from_hfov(width, hfov_deg)
    assert pinhole.bearing_deg(width) == pytest.approx(hfov_deg / 2)
    assert pinhole.bearing_deg(0) == pytest.approx(-hfov_deg / 2)
    assert pinhole.bearing_deg(width / 2) == 0
    assert pinhole.hfov_deg == pytest.approx(hfov_deg)


@given(widths, views, heights, distances, bearings)
def test_a_box_leads_back_to_where_the_thing_stands(width, hfov_deg, height_mm, distance_mm, bearing_deg):
    pinhole = Pinhole.from_hfov(width, hfov_deg)
    depth_mm = distance_mm * math.cos(math.radians(bearing_deg))
    height_px = pinhole.focal_px * height_mm / depth_mm
    assert pinhole.distance_mm(height_px, height_mm, bearing_deg) == pytest.approx(distance_mm)


@given(
    width=st.sampled_from([320, 640]),
    distance_mm=st.floats(400, 4000),
    bearing_deg=st.floats(-20, 20),
    slant_deg=st.floats(-60, 60),
)
def test_a_quad_leads_back_to_the_middle_of_a_slanted_sheet(width, distance_mm, bearing_deg, slant_deg):
    pinhole = Pinhole.from_hfov(width, 60)
    x, depth = (distance_mm * f(math.radians(bearing_deg)) for f in (math.sin, math.cos))
    along, towards = 105 * math.cos(math.radians(slant_deg)), 105 * math.sin(math.radians(slant_deg))

    def pixel(side, height_mm):
        z = depth + side * towards
        return width / 2 + pinhole.focal_px * (x + side * along) / z, 120 + pinhole.focal_px * height_mm / z

    quad = (pixel(-1, -148.5), pixel(1, -148.5), pixel(1, 148.5), pixel(-1, 148.5))
    found_bearing_deg, found_distance_mm = pinhole.locate(Detection(box_of(quad), 1.0, quad), 297)
    assert found_bearing_deg == pytest.approx(bearing_deg, abs=1e-6)
    assert found_distance_mm == pytest.approx(distance_mm)


@given(heights, distances, widths, views)
def test_calibration_recovers_the_focal_length(height_mm, distance_mm, width, hfov_deg):
    focal_px = Pinhole.from_hfov(width, hfov_deg).focal_px
    assert focal_from(focal_px * height_mm / distance_mm, height_mm, distance_mm) == pytest.approx(focal_px)


def test_an_a4_sheet_at_a_metre_calibrates_a_webcam():
    pinhole = Pinhole(640, focal_from(164.6))
    assert pinhole.focal_px == pytest.approx(554.2, abs=0.1)
    assert pinhole.hfov_deg == pytest.approx(60, abs=0.01)


def test_positive_is_right():
    assert Pinhole.from_hfov(320, 60).bearing_deg(200) > 0


def test_the_same_camera_with_smaller_frames_sees_the_same_angle():
    assert Pinhole.from_hfov(640, 55).resized(320).hfov_deg == pytest.approx(55)


@pytest.mark.parametrize("hfov_deg", [0, -10, 180, 400])
def test_an_impossible_view_is_refused(hfov_deg):
    with pytest.raises(ConfigError, match=r"horizontal view"):
        Pinhole.from_hfov(320, hfov_deg)


@pytest.mark.parametrize("focal_px", [0, -1, math.nan, math.inf])
def test_an_impossible_focal_length_is_refused(focal_px):
    with pytest.raises(ConfigError, match=r"focal length"):
        Pinhole(320, focal_px)


def test_a_measurement_must_be_positive():
    with pytest.raises(ValueError, match=r"positive"):
        focal_from(0)
    with pytest.raises(ValueError, match=r"positive"):
        Pinhole.from_hfov(320).distance_mm(0, 297)


def test_diagonals_cross_in_the_middle_of_a_square():
    assert crossing(((0, 0), (4, 0), (4, 4), (0, 4))) == (2, 2)


boxes = st.tuples(st.integers(-50, 50), st.integers(-50, 50), st.integers(1, 80), st.integers(1, 80))


@given(boxes, boxes)
def test_overlap_is_a_symmetric_share(a, b):
    assert overlap(a, a) == 1
    assert overlap(a, b) == overlap(b, a)
    assert 0 <= overlap(a, b) <= 1


def test_overlap_of_boxes_that_share_a_third():
    assert overlap((0, 0, 10, 10), (5, 0, 10, 10)) == pytest.approx(1 / 3)
    assert overlap((0, 0, 10, 10), (10, 0, 10, 10)) == 0
