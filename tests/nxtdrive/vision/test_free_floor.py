"""The free floor in frames: it ends where geometry says, and there is no result where nothing is known."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nxtdrive.vision.free_floor import FreeFloorDetector
from nxtdrive.vision.geometry import Pinhole
from sim_backend.camera.scene import Panel, Viewpoint, standing_panels
from sim_backend.camera.sim_camera import SimCamera

ORIGIN = Viewpoint(0.0, 0.0, 0.0, 200.0)


def wall(ahead_mm, texture="wall"):
    """A wall across the whole view."""
    return Panel(ahead_mm, -9000.0, ahead_mm, 9000.0, 0.0, 2500.0, texture)


def box(ahead_mm, right_mm, texture="blue_box", half_mm=150.0):
    near, far, left, right = ahead_mm, ahead_mm + 2 * half_mm, right_mm - half_mm, right_mm + half_mm
    return standing_panels([(near, left), (far, left), (far, right), (near, right)], 300.0, texture)


def learn(detector, image, time_s):
    """Learn from a frame at once."""
    detector.keep(image, time_s)
    detector.learn(time_s)


@pytest.fixture(scope="module")
def cameras():
    return {size: SimCamera(size, seed=3) for size in ((320, 240), (640, 480))}


@pytest.fixture(scope="module")
def look(cameras):
    """Takes a frame of a place."""

    def take(panels, size=(320, 240), viewpoint=ORIGIN, brightness=1.0):
        return cameras[size].frame(panels, viewpoint, 0.0, brightness)

    return take


@pytest.fixture(scope="module")
def detector(look):
    """Has learned the oak floor from places two metres from a wall."""
    made = FreeFloorDetector()
    for number in range(6):
        viewpoint = Viewpoint(150.0 * number, 90.0 * number, 0.0, 200.0)
        learn(made, look([wall(3000.0)], viewpoint=viewpoint), float(number))
    return made


def ahead_mm(ends, size=(320, 240)):
    """How far along the camera's heading the floor ends, by bearing."""
    bearing_deg, below_deg = Pinhole.from_hfov(size[0], 60.0).directions(*ends.T)
    ahead = 200.0 / np.tan(np.radians(below_deg)) * np.cos(np.radians(bearing_deg))
    return dict(zip(bearing_deg.tolist(), ahead.tolist(), strict=True))


def rows_off(ends, truth_mm, size=(320, 240)):
    """How many pixels of a 320-px frame the rows differ from those of floor that ends so far ahead."""
    focal_px = size[0] / 2 / math.tan(math.radians(30.0))
    return (ends[:, 1] - size[1] / 2 - focal_px * 200.0 / truth_mm) * 320 / size[0]


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
@pytest.mark.parametrize("distance_mm", [600.0, 1200.0, 2500.0])
def test_the_floor_ends_at_a_wall(detector, look, size, distance_mm):
    ends = detector.ends(look([wall(distance_mm)], size))
    assert len(ends) == 24
    assert np.abs(rows_off(ends, distance_mm, size)).max() < 2.5


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
def test_the_floor_ends_at_a_box_and_behind_it_at_the_wall(detector, look, size):
    found = ahead_mm(detector.ends(look([wall(2500.0), *box(900.0, 200.0)], size)), size)
    at_box = [mm for bearing, mm in found.items() if 50.0 < 900.0 * math.tan(math.radians(bearing)) < 350.0]
    beside = [mm for bearing, mm in found.items() if bearing < -2.0 or bearing > 24.0]
    assert len(at_box) >= 6
    assert len(beside) >= 10
    assert at_box == pytest.approx([900.0] * len(at_box), rel=0.04)
    assert beside == pytest.approx([2500.0] * len(beside), rel=0.1)


def test_the_columns_are_spread_evenly_over_the_frame(detector, look):
    columns = detector.ends(look([wall(1500.0)]))[:, 0]
    assert columns == pytest.approx((np.arange(24) + 0.5) / 24 * 320, abs=0.5)


def test_it_is_not_ready_before_it_has_learned(look):
    image, fresh = look([wall(1500.0)]), FreeFloorDetector()
    assert not fresh.ready
    assert len(fresh.ends(image)) == 0
    learn(fresh, image, 0.0)
    assert fresh.ready
    assert len(fresh.ends(image)) == 24


def test_columns_whose_lowest_pixels_are_not_floor_have_no_result(detector, look):
    ends = detector.ends(look([wall(2000.0), *box(350.0, 0.0, half_mm=80.0)]))
    hidden_px = 320 / 2 / math.tan(math.radians(30.0)) * 80.0 / 350.0
    aside_px = np.abs(ends[:, 0] - 160.0)
    assert 10 <= len(ends) <= 18
    assert aside_px.min() > hidden_px - 7.0


def test_a_wall_of_the_colour_of_the_floor_is_floor_up_to_the_upper_edge(detector):
    camera = SimCamera(seed=3)
    floor = camera.frame([], ORIGIN)
    floor[:130] = floor[130:140].repeat(13, axis=0)
    ends = detector.ends(floor)
    assert len(ends) == 24
    assert not ends[:, 1].any()


@pytest.mark.parametrize("brightness", [0.5, 0.75, 0.85, 1.2, 1.3])
def test_sudden_light_or_shade_does_not_invent_obstacles(detector, look, brightness):
    ends = detector.ends(look([wall(2000.0)], brightness=brightness))
    assert len(ends) == 24
    assert np.median(rows_off(ends, 2000.0)) == pytest.approx(0.0, abs=1.0)
    assert (np.abs(rows_off(ends, 2000.0)) < 2.5).mean() > 0.9


def test_what_is_right_ahead_is_not_taken_for_floor_in_another_light(detector, look):
    near = np.full((240, 320, 3), (200, 30, 30), np.uint8)
    near[:120] = look([wall(2000.0)])[:120]
    assert len(detector.ends(near)) == 0
    assert len(detector.ends(look([wall(2000.0)], brightness=0.6))) == 24


def test_one_frame_in_much_stronger_light_is_enough_to_recognise_the_floor_again(look):
    taught = FreeFloorDetector()
    for number in range(10):
        learn(taught, look([wall(3000.0)], viewpoint=Viewpoint(90.0 * number, 0.0, 0.0, 200.0)), float(number))
    learn(taught, look([wall(3000.0)], brightness=1.4), 20.0)
    ends = taught.ends(look([wall(2000.0)], brightness=1.4))
    assert len(ends) == 24
    assert (np.abs(rows_off(ends, 2000.0)) < 2.5).mean() > 0.9


def test_specks_on_the_floor_do_not_end_it(detector, look):
    image = look([wall(2000.0)])
    for column in range(8, 320, 16):
        cv2.rectangle(image, (column, 200), (column + 2, 202), (250, 250, 250), -1)
    assert np.abs(rows_off(detector.ends(image), 2000.0)).max() < 2.5


def test_frames_that_follow_at_once_are_not_learned_from(look):
    taught = FreeFloorDetector()
    learn(taught, look([wall(3000.0)]), 0.0)
    carpet = np.full((240, 320, 3), (200, 30, 30), np.uint8)
    for hundredths in range(1, 20):
        learn(taught, carpet, hundredths / 100)
    assert len(taught.ends(carpet)) == 0
    assert len(taught.ends(look([wall(2000.0)]))) == 24


def test_a_frame_can_be_learned_from_later(look):
    taught, image = FreeFloorDetector(), look([wall(1500.0)])
    taught.keep(look([wall(3000.0)]), 1.0)
    taught.keep(np.full((240, 320, 3), (200, 30, 30), np.uint8), 2.0)
    taught.learn(1.5)
    assert not taught.ready, "no frame was taken then"
    taught.learn(1.0)
    assert len(taught.ends(image)) == 24


def test_frames_are_not_kept_for_ever(look):
    taught = FreeFloorDetector()
    for second in range(100):
        taught.keep(look([wall(3000.0)]), float(second))
    taught.learn(60.0)
    assert not taught.ready
    taught.learn(95.0)
    assert taught.ready


def test_a_floor_of_another_colour_is_learned_and_the_old_one_is_not_forgotten_at_once(look):
    taught = FreeFloorDetector()
    learn(taught, look([wall(3000.0)]), 0.0)
    carpet = np.full((240, 320, 3), (200, 30, 30), np.uint8)
    carpet[:120] = (30, 200, 30)
    for number in range(1, 20):
        learn(taught, carpet, float(number))
    assert rows_off(taught.ends(carpet), math.inf) == pytest.approx(0.0, abs=2.5)
    assert len(taught.ends(look([wall(2000.0)]))) == 24


@st.composite
def images(draw):
    height, width = draw(st.integers(1, 40)), draw(st.sampled_from([1, 2, 3, 7, 50, 320, 333, 700]))
    kind, seed = draw(st.sampled_from(["noise", "plain", "blocks"])), draw(st.integers(0, 99))
    rng = np.random.default_rng(seed)
    if kind == "plain":
        return np.full((height, width, 3), rng.integers(0, 256, 3), np.uint8)
    if kind == "noise":
        return rng.integers(0, 256, (height, width, 3), np.uint8)
    few = rng.integers(0, 256, (draw(st.integers(1, 5)), draw(st.integers(1, 5)), 3), np.uint8)
    return cv2.resize(few, (width, height), interpolation=cv2.INTER_NEAREST)


def check_ends(learned_from, image):
    detector = FreeFloorDetector()
    for number, one in enumerate(learned_from):
        learn(detector, one, float(number))
    ends = detector.ends(image)
    height, width = image.shape[:2]
    assert ends.shape[1:] == (2,)
    assert len(ends) <= 24
    assert ((ends >= 0.0) & (ends <= (width, height))).all()


@pytest.mark.slow
@settings(max_examples=25)
@given(st.lists(images(), max_size=2), images())
def test_any_image_gives_only_pixels_of_its_frame(learned_from, image):
    check_ends(learned_from, image)


@pytest.mark.parametrize("size", [(1, 1), (320, 1), (320, 4), (640, 3), (641, 7), (2, 5)])
def test_tiny_images_give_only_pixels_of_their_frame(size):
    image = np.full((size[1], size[0], 3), 90, np.uint8)
    other = image.copy()
    other[: size[1] // 2] = 200
    check_ends([image], other)
    check_ends([other], image)
