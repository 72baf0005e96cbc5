"""The visual gyroscope: it measures turns in rendered rooms, and nothing where frames do not show them."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nxtdrive.vision.camera import ReplayCamera
from nxtdrive.vision.geometry import Pinhole
from nxtdrive.vision.target_vision import CameraVision
from nxtdrive.vision.visual_gyroscope import VisualGyroscope
from sim_backend.camera.scene import Panel, Viewpoint, standing_panels
from sim_backend.camera.sim_camera import SimCamera

FOUR_WALLS = [(-2000.0, -2000.0), (2000.0, -2000.0), (2000.0, 2000.0), (-2000.0, 2000.0)]
ROOM = [
    *(Panel(*one, *other, 0.0, 2500.0, "bricks") for one, other in pairwise(FOUR_WALLS)),
    *standing_panels([(900.0, 400.0), (1200.0, 400.0), (1200.0, 700.0), (900.0, 700.0)], 400.0, "crate"),
    *standing_panels([(1400.0, -700.0), (1600.0, -700.0), (1600.0, -400.0), (1400.0, -400.0)], 300.0, "blue_box"),
]


def frame(heading_deg=0.0, ahead_mm=0.0, size=(320, 240), hfov_deg=60.0):
    x_mm, y_mm = (ahead_mm * turn(math.radians(heading_deg)) for turn in (math.cos, math.sin))
    return SimCamera(size, hfov_deg, seed=1).frame(ROOM, Viewpoint(x_mm, y_mm, heading_deg, 200.0))


def turned_deg(*frames, pinhole=None):
    """What the last of some frames shows."""
    gyroscope = VisualGyroscope()
    shape = frames[-1].shape
    pinhole = pinhole or Pinhole.from_hfov(shape[1]).resized(shape[1], shape[0])
    return [gyroscope.turned_deg(each, pinhole) for each in frames][-1]


@pytest.mark.parametrize(("size", "hfov_deg"), [((320, 240), 60.0), ((640, 480), 60.0), ((640, 360), 75.0)])
@pytest.mark.parametrize("angle_deg", [-5.0, -1.0, 0.0, 3.0])
def test_a_turn_is_measured_in_degrees_positive_right(angle_deg, size, hfov_deg):
    seen = [frame(each, size=size, hfov_deg=hfov_deg) for each in (20.0, 20.0 + angle_deg)]
    pinhole = Pinhole.from_hfov(size[0], hfov_deg).resized(*size)
    assert turned_deg(*seen, pinhole=pinhole) == pytest.approx(angle_deg, abs=0.1)


@pytest.mark.parametrize("ahead_mm", [-20.0, 20.0, 40.0])
def test_a_drive_is_no_turn(ahead_mm):
    assert turned_deg(frame(), frame(ahead_mm=ahead_mm)) == pytest.approx(0.0, abs=0.4)


def test_a_turn_during_a_drive_is_measured():
    assert turned_deg(frame(), frame(2.0, ahead_mm=20.0)) == pytest.approx(2.0, abs=0.4)


def test_the_first_frame_shows_no_turn():
    assert turned_deg(frame()) is None


@pytest.mark.parametrize(
    "frames",
    [
        [np.full((240, 320, 3), 90, np.uint8)] * 2,
        [frame(0.0), np.full((240, 320, 3), 90, np.uint8)],
        [frame(20.0), frame(200.0)],
        [frame(0.0), frame(0.0)[:120]],
    ],
    ids=["of a plain wall", "then of a plain wall", "of opposite walls", "of two shapes"],
)
def test_frames_without_much_in_common_show_no_turn(frames):
    gyroscope = VisualGyroscope()
    for each in frames:
        height, width = each.shape[:2]
        shown = gyroscope.turned_deg(each, Pinhole.from_hfov(width).resized(width, height))
    assert shown is None


def test_what_moves_through_a_part_of_the_frame_is_no_turn():
    before, now = frame(), frame()
    before[60:200, 40:100] = now[60:200, 64:124] = np.random.default_rng(1).integers(0, 255, (140, 60, 3), np.uint8)
    assert turned_deg(before, now) == pytest.approx(0.0, abs=0.1)


@settings(max_examples=30)
@given(width=st.integers(1, 400), height=st.integers(1, 400), seed=st.integers(0, 9))
def test_frames_of_any_shape_are_accepted(width, height, seed):
    noise = np.random.default_rng(seed).integers(0, 255, (2, height, width, 3), np.uint8)
    assert turned_deg(*noise) is None or width * height > 100


def test_a_glimpse_has_the_turn_since_the_last_one(clock):
    frames = iter([frame(0.0), frame(2.0), frame(4.0), frame(5.0)])
    vision = CameraVision(ReplayCamera("test", frames, 10, clock), {}, Pinhole.from_hfov(320), latency_s=0.05)
    turns = [vision.glance([]).turned_deg for _ in range(4)]
    assert turns[0] is None
    assert turns[1:] == pytest.approx([2.0, 2.0, 1.0], abs=0.1)
