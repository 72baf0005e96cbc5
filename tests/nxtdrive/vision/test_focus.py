"""Looks near the last position of a target."""

from dataclasses import replace

import numpy as np
import pytest

from behaviors.ports import Cut
from nxtdrive.vision.cut_off import marked
from nxtdrive.vision.detectors.color import ColorDetector
from nxtdrive.vision.focus import detect_near

WIDTH, HEIGHT = 640, 480
RED = ColorDetector("red")


def _frame(box):
    """Return a grey frame with a red patch."""
    left, top, width, height = box
    frame = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    frame[max(0, top) : top + height, max(0, left) : left + width] = (30, 30, 200)
    return frame


@pytest.mark.parametrize("size", [(14, 14), (20, 20), (100, 100), (30, 120), (120, 30), (90, 160)])
@pytest.mark.parametrize("direction", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_target_is_found_where_it_moved_to(size, direction):
    moved_px = max(20, 0.6 * max(size))
    left, top = (round(300 + moved_px * direction[0]), round(200 + moved_px * direction[1]))
    (near,) = detect_near(RED, _frame((left, top, *size)), (300, 200, *size))
    # a target is shrunk to 80 pixels
    assert near.box == pytest.approx((left, top, *size), abs=max(size) / 80 + 1)
    assert near.cut == Cut.NONE


class Cornered:
    """Finds red patches and their corners."""

    def detect(self, image):
        return [replace(each, quad=_corners(each.box)) for each in RED.detect(image)]


def _corners(box):
    left, top, width, height = box
    return ((left, top), (left + width, top), (left + width, top + height), (left, top + height))


@pytest.mark.parametrize("box", [(300, 200, 30, 40), (300, 150, 150, 200)])
def test_corners_are_those_in_the_frame(box):
    (near,) = detect_near(Cornered(), _frame(box), box)
    for corner, expected in zip(near.quad, _corners(box), strict=True):
        assert corner == pytest.approx(expected, abs=3)


@pytest.mark.parametrize("direction", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_target_that_moved_too_far_is_left_to_a_look_at_the_whole_frame(direction):
    frame = _frame((300 + 70 * direction[0], 200 + 70 * direction[1], 60, 60))  # half of it is searched
    assert detect_near(RED, frame, (300, 200, 60, 60)) == []


class Watching:
    """Keeps the size of the picture that it is given."""

    def detect(self, image):
        self.size = image.shape[:2]
        return []


@pytest.mark.parametrize(
    ("size", "searched"),
    [((20, 40), (96, 76)), ((40, 80), (192, 152)), ((80, 160), (192, 152)), ((100, 200), (192, 152))],
)
def test_a_large_target_is_shrunk_before_detection_and_a_small_one_is_not_enlarged(size, searched):
    detector = Watching()
    frame = np.zeros((1080, 1920, 3), np.uint8)
    assert detect_near(detector, frame, (600, 400, *size)) == []
    assert detector.size == searched


@pytest.mark.parametrize(
    "box",
    [
        (0, 200, 50, 60),
        (300, 0, 50, 60),
        (WIDTH - 50, 200, 50, 60),
        (300, HEIGHT - 60, 50, 60),
        (0, 0, 50, 60),
        (WIDTH - 50, HEIGHT - 60, 50, 60),
        (0, 100, WIDTH, 200),
    ],
)
def test_a_target_at_the_edge_of_the_frame_is_cut_off_there(box):
    frame = _frame(box)
    (near,) = detect_near(RED, frame, box)
    (whole,) = marked(RED.detect(frame), WIDTH, HEIGHT)
    assert near.cut == whole.cut != Cut.NONE
    assert near.bound
    assert near.box == pytest.approx(whole.box, abs=4)


@pytest.mark.parametrize("box", [(-400, 200, 50, 60), (300, -400, 50, 60), (900, 200, 50, 60), (300, 900, 50, 60)])
def test_beyond_the_frame_nothing_is_found(box):
    assert detect_near(RED, _frame((300, 200, 50, 60)), box) == []
