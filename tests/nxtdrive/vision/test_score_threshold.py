"""The score that a picture needs so that chance matches do not reach it."""

import numpy as np
import pytest

from nxtdrive.vision.detectors.score_threshold import coarseness, distinctness, min_score

DETAILS = np.random.default_rng(3).uniform(0, 255, (24, 17, 3)).astype(np.float32)


def gradient():
    """A picture that grows brighter from the left to the right."""
    return np.tile(np.linspace(20, 220, 17, dtype=np.float32)[None, :, None], (24, 1, 3))


def test_a_gradient_is_coarse_and_details_are_not():
    assert coarseness(gradient()) > 0.95
    assert coarseness(DETAILS) < 0.1


def test_colours_are_not_coarse_gray():
    gray, colored = gradient(), gradient()
    colored[:, :, 2] = colored[:, ::-1, 2]
    assert coarseness(colored) < coarseness(gray) - 0.2


def test_a_picture_without_contrast_is_not_coarse():
    assert coarseness(np.full((24, 17, 3), 90, np.float32)) == 0


@pytest.mark.parametrize("core", [False, True])
def test_coarse_pictures_few_waves_and_few_pixels_need_a_higher_score(core):
    usual = min_score(0.3, 20, 600, core=core)
    assert min_score(0.6, 20, 600, core=core) > usual
    assert min_score(0.3, 4, 600, core=core) > usual
    assert min_score(0.3, 20, 150, core=core) > usual


def test_stripes_have_fewer_waves_than_a_portrait(astronaut):
    rows = np.where(np.arange(len(astronaut)) // 30 % 2, 220, 30).astype(np.uint8)
    stripes = np.ones_like(astronaut) * rows[:, None, None]
    assert distinctness(stripes) < distinctness(astronaut) / 3
