"""The detector on its own: frames in, places out."""

from __future__ import annotations

import numpy as np
import pytest
from lamp import LampDetector, from_spec

from nxtdrive.errors import ConfigError
from nxtdrive.vision.detectors.spec import DetectorSpec


def frame(*lamps):
    image = np.full((240, 320, 3), 60, np.uint8)
    for left, top, side in lamps:
        image[top : top + side, left : left + side] = 255
    return image


def test_it_finds_the_larger_lamp_first():
    found = LampDetector().detect(frame((20, 30, 10), (200, 100, 24), (5, 5, 2)))
    assert [one.box for one in found] == [(200, 100, 24, 24), (20, 30, 10, 10)]
    assert LampDetector().detect(frame()) == []


def test_its_keys_are_those_of_the_target(tmp_path):
    assert from_spec(DetectorSpec("lamp", {"least_px": 50}, tmp_path)).detect(frame((20, 30, 10))) == []
    with pytest.raises(ConfigError, match="least_brightness of the lamp detector must be a whole number"):
        from_spec(DetectorSpec("lamp", {"least_brightness": "bright"}, tmp_path))
    with pytest.raises(ConfigError, match="least_brightness = 300 is not valid"):
        LampDetector(300)
