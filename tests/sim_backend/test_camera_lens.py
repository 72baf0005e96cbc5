"""The webcam's imperfections, each by its effect on a frame."""

import math

import cv2
import numpy as np
import pytest

from sim_backend.camera.lens import PERFECT, Lens, LensEffects

SIZE = (320, 240)
FOCAL_PX = 160 / math.tan(math.radians(30))


def lens(seed=0, **effects):
    return Lens(LensEffects(**{"softness_px": 0.0, "noise": 0.0, "shutter_s": 0.0} | effects), SIZE, FOCAL_PX, seed)


def gray(level):
    return np.full((SIZE[1], SIZE[0], 3), level, np.uint8)


def edge():
    image = gray(50)
    image[:, 160:] = 200
    return image


def ramp_width(frame):
    """Over how many columns the edge rises."""
    row = frame[120, :, 0].astype(int)
    return int(((row > 55) & (row < 195)).sum())


def test_without_effects_nothing_changes():
    assert np.array_equal(Lens(PERFECT, SIZE, FOCAL_PX).expose(edge(), 120.0), edge())


def test_brightness_scales_a_frame_and_saturates():
    assert np.unique(lens().expose(gray(100), brightness=1.5)).tolist() == [150]
    assert np.unique(lens().expose(gray(220), brightness=1.5)).tolist() == [255]


def test_noise_has_the_strength_asked_for_no_bias_and_differs_from_frame_to_frame():
    noisy = lens(noise=4.0)
    first, second = noisy.expose(gray(128)).astype(float), noisy.expose(gray(128)).astype(float)
    assert first.std() == pytest.approx(4.0, rel=0.05)
    assert first.mean() == pytest.approx(128.0, abs=0.1)
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.1


def test_noise_depends_on_the_seed_alone():
    assert np.array_equal(lens(1, noise=4.0).expose(gray(90)), lens(1, noise=4.0).expose(gray(90)))
    assert not np.array_equal(lens(1, noise=4.0).expose(gray(90)), lens(2, noise=4.0).expose(gray(90)))


def test_softness_widens_an_edge_and_keeps_the_mean():
    soft = lens(softness_px=0.8).expose(edge())
    assert ramp_width(soft) >= 2
    assert soft.mean() == pytest.approx(edge().mean(), abs=0.5)


@pytest.mark.parametrize("turn_rate_deg_s", [30.0, 90.0, -90.0, 240.0])
def test_turning_smears_by_turn_rate_times_exposure(turn_rate_deg_s):
    blurred = lens(shutter_s=0.02)
    length = FOCAL_PX * math.tan(math.radians(abs(turn_rate_deg_s) * 0.02))
    assert ramp_width(blurred.expose(edge(), turn_rate_deg_s)) == pytest.approx(length, abs=2.0)


def test_turning_does_not_smear_upright():
    image = cv2.rotate(edge()[:, 40:280], cv2.ROTATE_90_CLOCKWISE)
    image = np.repeat(image[:, :1], SIZE[0], axis=1)
    assert np.array_equal(lens(shutter_s=0.02).expose(image, 200.0), image)


def test_compression_leaves_traces_but_keeps_the_picture():
    # JPEG codes blocks of 8 x 8: an edge between two blocks would come through unharmed
    image = np.roll(edge(), 3, axis=1)
    pressed = lens(jpeg_quality=60).expose(image)
    assert not np.array_equal(pressed, image)
    assert np.abs(pressed.astype(int) - image).mean() < 3.0
