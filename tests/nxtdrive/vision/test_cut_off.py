"""Targets that the frame cuts off."""

import numpy as np
import pytest

from behaviors.ports import Cut, Sighting
from nxtdrive.vision.camera import ReplayCamera
from nxtdrive.vision.cut_off import Shape, marked
from nxtdrive.vision.detection import Detection, TargetDetector
from nxtdrive.vision.detectors.color import ColorDetector
from nxtdrive.vision.focus import detect_near
from nxtdrive.vision.geometry import Pinhole
from nxtdrive.vision.target_vision import CameraVision

WIDTH, HEIGHT = 320, 240
PINHOLE = Pinhole.from_hfov(WIDTH, 60)
WIDTH_MM, HEIGHT_MM, LENS_MM = 200.0, 100.0, 170.0
SQUARE_QUAD = ((300.0, 100.0), (340.0, 100.0), (340.0, 160.0), (300.0, 160.0))


def _frame(distance_mm, bearing_deg=0.0, bottom_mm=0.0):
    """Return a grey room with a red patch on the floor, or higher up, as a level camera sees it."""
    frame = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    scale = PINHOLE.focal_px / (distance_mm * np.cos(np.radians(bearing_deg)))
    column = WIDTH / 2 + PINHOLE.focal_px * np.tan(np.radians(bearing_deg))
    left, right = column - scale * WIDTH_MM / 2, column + scale * WIDTH_MM / 2
    top, bottom = (HEIGHT / 2 + scale * (LENS_MM - bottom_mm - up) for up in (HEIGHT_MM, 0.0))
    frame[max(0, round(top)) : max(0, round(bottom)), max(0, round(left)) : max(0, round(right))] = (30, 30, 200)
    return frame


@pytest.fixture
def look(clock):
    """Look at patches in the frames, ten a second; return the sightings."""

    def sightings(frames):
        targets = {"box": TargetDetector(ColorDetector("red"), HEIGHT_MM)}
        vision = CameraVision(ReplayCamera("test", iter(frames), 10, clock), targets, PINHOLE)
        return [vision.look("box") for _ in frames][1:]

    return sightings


@pytest.mark.parametrize("bottom_mm", [0.0, 40.0, 230.0])
@pytest.mark.parametrize("bearing_deg", [-8.0, 0.0, 5.0])
def test_a_target_that_leaves_the_frame_above_or_below_stays_where_it_is(look, bottom_mm, bearing_deg):
    distances = np.linspace(900, 260, 65)
    sightings = look([_frame(distance_mm, bearing_deg, bottom_mm) for distance_mm in distances])
    assert sightings[-1].cut in (Cut.BOTTOM, Cut.TOP)
    for distance_mm, sighting in zip(distances[1:], sightings, strict=True):
        assert not sighting.bound
        assert sighting.distance_mm == pytest.approx(distance_mm, rel=0.06)
        assert sighting.bearing_deg == pytest.approx(bearing_deg, abs=1.0)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_target_that_leaves_the_frame_at_a_side_stays_where_it_is(look, side):
    bearings = side * np.linspace(10, 30, 40)
    sightings = look([_frame(700, bearing_deg) for bearing_deg in bearings])
    assert sightings[-1].cut is (Cut.RIGHT if side > 0 else Cut.LEFT)
    for bearing_deg, sighting in zip(bearings[1:], sightings, strict=True):
        assert not sighting.bound
        assert sighting.distance_mm == pytest.approx(700, rel=0.06)
        assert sighting.bearing_deg == pytest.approx(bearing_deg, abs=1.0)


@pytest.mark.parametrize("bearing_deg", [-33.0, -27.0, 0.0, 27.0, 33.0])
@pytest.mark.parametrize("distance_mm", [260, 320, 380])
def test_what_was_never_wholly_in_view_is_no_farther_away_and_no_nearer_to_the_middle(look, distance_mm, bearing_deg):
    sighting = look([_frame(distance_mm, bearing_deg)] * 3)[-1]
    assert sighting.bound
    assert Cut.BOTTOM in sighting.cut
    assert sighting.distance_mm >= 0.97 * distance_mm * np.cos(np.radians(bearing_deg))
    assert abs(sighting.bearing_deg) <= abs(bearing_deg) + 1.0


def test_corners_locate_a_target_even_outside_of_the_frame():
    beyond = Detection((300, 100, 40, 60), 1.0, SQUARE_QUAD)
    assert marked([beyond], WIDTH, HEIGHT) == [beyond]


@pytest.mark.parametrize(
    ("box", "cut"),
    [
        ((20, 20, 40, 40), Cut.NONE),
        ((0, 20, 40, 40), Cut.LEFT),
        ((20, -3, 40, 40), Cut.TOP),
        ((281, 20, 38, 40), Cut.RIGHT),
        ((20, 200, 40, 40), Cut.BOTTOM),
        ((0, 200, 320, 40), Cut.LEFT | Cut.RIGHT | Cut.BOTTOM),
        ((3, 3, 40, 40), Cut.LEFT | Cut.TOP),
        ((4, 4, 40, 40), Cut.NONE),
        ((277, 197, 40, 40), Cut.RIGHT | Cut.BOTTOM),
        ((276, 196, 40, 40), Cut.NONE),
    ],
)
def test_a_box_that_ends_with_the_frame_is_cut_off_there(box, cut):
    (one,) = marked([Detection(box, 1.0)], WIDTH, HEIGHT)
    assert (one.cut, one.bound) == (cut, bool(cut))


def test_what_a_crop_cuts_off_is_looked_for_in_the_whole_frame():
    frame = _frame(600)
    (whole,) = ColorDetector("red").detect(frame)
    left, top, _, _ = whole.box
    assert detect_near(ColorDetector("red"), frame, whole.box)
    assert detect_near(ColorDetector("red"), frame, (left, top, 10, 10)) == []


def test_one_view_of_a_part_does_not_change_the_shape():
    shape = Shape()
    for width in (100, 100, 30, 100):
        shape.learn(Sighting("box", 0.0, 500.0, 1.0, 0.0, (50, 50, width, 50)))
    (cut_off,) = marked([Detection((50, 200, 120, 40), 1.0)], WIDTH, HEIGHT)
    assert shape.completed(cut_off).box == (50, 200, 120, 60)


@pytest.mark.parametrize(
    ("shape", "visible", "whole", "bound"),
    [
        ((100, 50), (50, 0, 120, 40), (50, -20, 120, 60), False),
        ((100, 50), (50, 200, 120, 40), (50, 200, 120, 60), False),
        ((100, 50), (0, 90, 60, 50), (-40, 90, 100, 50), False),
        ((100, 50), (260, 90, 60, 50), (260, 90, 100, 50), False),
        ((100, 50), (0, 20, 320, 200), (-40, 20, 400, 200), False),
        ((50, 200), (90, 0, 80, 240), (90, -40, 80, 320), False),
        ((100, 50), (0, 200, 60, 40), (-20, 200, 80, 40), True),
        ((100, 50), (260, 0, 60, 40), (260, 0, 80, 40), True),
        ((100, 50), (90, 90, 60, 40), (90, 90, 60, 40), False),
    ],
)
def test_the_part_that_is_out_of_view_lies_beyond_the_edge(shape, visible, whole, bound):
    known = Shape()
    known.learn(Sighting("box", 0.0, 500.0, 1.0, 0.0, (50, 50, *shape)))
    completed = known.completed(*marked([Detection(visible, 1.0)], WIDTH, HEIGHT))
    assert (completed.box, completed.bound) == (whole, bound)


def test_what_a_detector_calls_larger_than_its_box_stays_so_in_the_middle_of_the_frame():
    shape = Shape()
    shape.learn(Sighting("box", 0.0, 500.0, 1.0, 0.0, (50, 50, 100, 50)))
    half_hidden = Detection((90, 90, 60, 40), 1.0, bound=True)
    assert shape.completed(half_hidden) == half_hidden


@pytest.mark.parametrize("size", [(0, 40), (40, 0)])
def test_what_is_seen_edge_on_has_no_shape(size):
    shape = Shape()
    shape.learn(Sighting("box", 0.0, 500.0, 1.0, 0.0, (50, 50, *size)))
    (cut_off,) = marked([Detection((50, 200, 120, 40), 1.0)], WIDTH, HEIGHT)
    assert shape.completed(cut_off) == cut_off


def test_sides_are_named_in_records():
    assert (Cut.LEFT | Cut.BOTTOM).names == ["left", "bottom"]
    assert Cut.NONE.names == []
