"""Bearings and distances from pixels, for level and tilted cameras."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, box_of, overlap
from nxtdrive.vision.geometry import Mounting, Pinhole, crossing

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


def _seen(pinhole, bearing_deg, distance_mm, *, width_mm=210, height_mm=297, below_mm=0.0):
    """Return the corners of an upright sheet that faces the lens, as a mounted camera sees them."""
    mounting = pinhole.mounting
    yaw, tilt, roll = (math.radians(a) for a in (mounting.yaw_deg, mounting.tilt_deg, mounting.roll_deg))
    off = math.radians(bearing_deg) - yaw
    corners = []
    for side, down in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        x = distance_mm * math.sin(off) + side * width_mm / 2 * math.cos(off)
        z = distance_mm * math.cos(off) - side * width_mm / 2 * math.sin(off)
        y = below_mm + down * height_mm / 2
        y, z = y * math.cos(tilt) + z * math.sin(tilt), z * math.cos(tilt) - y * math.sin(tilt)
        x, y = x * math.cos(roll) + y * math.sin(roll), y * math.cos(roll) - x * math.sin(roll)
        scale = pinhole.focal_px / z
        corners.append((pinhole.width / 2 + scale * x, pinhole.width * pinhole.aspect / 2 + scale * y))
    return tuple(corners)


angles = st.floats(-15, 15)


@given(angles, st.floats(-20, 20), angles, bearings, st.floats(500, 3000), st.floats(-200, 200))
def test_corners_seen_by_a_turned_camera_lead_back_to_the_sheet(yaw, tilt, roll, off_deg, distance_mm, below_mm):
    pinhole = Pinhole.from_hfov(640, 60, Mounting(yaw, tilt, roll))
    bearing_deg = yaw + off_deg / 2
    quad = _seen(pinhole, bearing_deg, distance_mm, below_mm=below_mm)
    found_deg, found_mm = pinhole.locate(Detection(box_of(quad), 1.0, quad), 297)
    assert found_deg == pytest.approx(bearing_deg, abs=1e-6)
    assert found_mm == pytest.approx(distance_mm, rel=1e-6)


@given(angles, st.floats(-10, 10), angles, st.floats(800, 2500))
def test_a_box_seen_by_a_turned_camera_leads_near_the_sheet(yaw, tilt, roll, distance_mm):
    pinhole = Pinhole.from_hfov(640, 60, Mounting(yaw, tilt, roll))
    box = box_of(_seen(pinhole, yaw, distance_mm))
    found_deg, found_mm = pinhole.locate(Detection(box, 1.0), 297)
    assert found_deg == pytest.approx(yaw, abs=1.0)
    assert found_mm == pytest.approx(distance_mm, rel=0.06)


@pytest.mark.parametrize("roll", [-44, -38, -20, 20, 35, 38, 44])
@pytest.mark.parametrize("distance_mm", [800, 2000])
def test_a_square_seen_by_a_camera_that_is_rolled_by_any_angle_leads_back_to_its_place(roll, distance_mm):
    pinhole = Pinhole.from_hfov(1920, 60, Mounting(roll_deg=roll))
    box = box_of(_seen(pinhole, 0, distance_mm, width_mm=300, height_mm=300))
    assert pinhole.locate(Detection(box, 1.0), 300) == pytest.approx((0, distance_mm), rel=0.02, abs=0.2)


@pytest.mark.parametrize("with_corners", [True, False])
@pytest.mark.parametrize(
    "mounting",
    [
        Mounting(),
        Mounting(yaw_deg=20),
        Mounting(tilt_deg=12),
        Mounting(tilt_deg=-12),
        Mounting(roll_deg=25),
        Mounting(roll_deg=-25),
        Mounting(10, -8, 15),
    ],
)
def test_place_and_edges_of_what_hangs_beside_the_middle(mounting, with_corners):
    pinhole = Pinhole.from_hfov(1920, 60, mounting)
    bearing_deg = mounting.yaw_deg + 8
    quad = _seen(pinhole, bearing_deg, 1500, width_mm=150, height_mm=400, below_mm=100)
    detection = Detection(box_of(quad), 1.0, quad if with_corners else None)
    found_deg, found_mm = pinhole.locate(detection, 400)
    assert found_deg == pytest.approx(bearing_deg, abs=0.3)
    assert found_mm == pytest.approx(1500, rel=0.01 if with_corners else 0.05)
    assert pinhole.edges_mm(detection, 400) == pytest.approx((-300, 100), abs=2 if with_corners else 16)


@given(st.floats(-60, 60), st.floats(-45, 45), st.floats(-45, 45), st.integers(0, 639), st.integers(0, 479))
def test_any_box_and_any_mounting_give_a_place(yaw, tilt, roll, left, top):
    pinhole = Pinhole.from_hfov(640, 140, Mounting(yaw, tilt, roll))
    bearing_deg, distance_mm = pinhole.locate(Detection((left, top, 20, 30), 1.0), 297)
    assert math.isfinite(bearing_deg)
    assert math.isfinite(distance_mm)
    assert distance_mm > 0


def test_a_camera_keeps_its_mounting_in_frames_of_another_size():
    pinhole = Pinhole.from_hfov(640, 60, Mounting(1, 2, 3)).resized(1280, 720)
    assert (pinhole.mounting, pinhole.bearing_deg(1280)) == (Mounting(1, 2, 3), pytest.approx(30))
    assert pinhole.aspect == 720 / 1280


def test_frames_of_the_same_width_may_be_lower():
    pinhole = Pinhole.from_hfov(640, 60)
    assert pinhole.resized(640, 360).aspect == 360 / 640
    assert pinhole.resized(640) == pinhole.resized(640, 480) == pinhole


@pytest.mark.parametrize(
    ("mounting", "pixel", "expected"),
    [
        (Mounting(), (320, 240), (0, 0)),
        (Mounting(), (640, 240), (30, 0)),
        (Mounting(), (320, 480), (0, 23.41)),
        (Mounting(yaw_deg=20), (320, 240), (20, 0)),
        (Mounting(yaw_deg=20), (640, 240), (50, 0)),
        (Mounting(tilt_deg=10), (320, 240), (0, -10)),
        (Mounting(tilt_deg=-10), (320, 480), (0, 33.41)),
        (Mounting(roll_deg=30), (640, 240), (26.57, 14.48)),
    ],
)
def test_a_pixel_shows_what_lies_in_a_direction(mounting, pixel, expected):
    found = Pinhole.from_hfov(640, 60, mounting).directions(*(np.array([float(place)]) for place in pixel))
    assert [float(angle[0]) for angle in found] == pytest.approx(expected, abs=0.01)


def test_positive_is_right():
    assert Pinhole.from_hfov(320, 60).bearing_deg(200) > 0


def test_the_same_camera_with_smaller_frames_sees_the_same_angle():
    assert Pinhole.from_hfov(640, 55).resized(320).bearing_deg(320) == pytest.approx(27.5)


@pytest.mark.parametrize("hfov_deg", [0, -10, 180, 400])
def test_an_impossible_view_is_refused(hfov_deg):
    with pytest.raises(ConfigError, match=r"horizontal field of view"):
        Pinhole.from_hfov(320, hfov_deg)


@pytest.mark.parametrize(
    ("width", "focal_px"), [(320, 0), (320, -1), (320, math.nan), (320, math.inf), (0, 300), (-320, 300)]
)
def test_an_impossible_focal_length_or_width_is_refused(width, focal_px):
    with pytest.raises(ConfigError, match=rf"frames {width} px wide and a focal length of {focal_px} px"):
        Pinhole(width, focal_px)


@pytest.mark.parametrize(("height_px", "height_mm"), [(0, 297), (-1, 297), (30, 0), (30, -297)])
def test_a_measurement_must_be_positive(height_px, height_mm):
    with pytest.raises(ValueError, match=r"positive"):
        Pinhole.from_hfov(320).distance_mm(height_px, height_mm)


def test_diagonals_cross_in_the_middle_of_a_square():
    assert crossing(((0, 0), (4, 0), (4, 4), (0, 4))) == (2, 2)


def test_what_is_seen_edge_on_has_a_middle_too():
    assert crossing(((0, 0), (4, 0), (4, 0), (0, 0))) == (2, 0)
    assert crossing(((3, 0), (3, 0), (3, 8), (3, 8))) == (3, 4)


boxes = st.tuples(st.integers(-50, 50), st.integers(-50, 50), st.integers(1, 80), st.integers(1, 80))


@given(boxes, boxes)
def test_overlap_is_a_symmetric_share(a, b):
    assert overlap(a, a) == 1
    assert overlap(a, b) == overlap(b, a)
    assert 0 <= overlap(a, b) <= 1


def test_overlap_of_boxes_that_share_a_third():
    assert overlap((0, 0, 10, 10), (5, 0, 10, 10)) == pytest.approx(1 / 3)
    assert overlap((0, 0, 10, 10), (10, 0, 10, 10)) == 0
