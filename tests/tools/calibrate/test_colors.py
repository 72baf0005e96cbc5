"""Learning how a colour looks."""

import cv2
import numpy as np
import pytest

from nxtdrive.tools.calibrate.colors import learn
from nxtdrive.tools.calibrate.course import CalibrationRefused
from nxtdrive.vision.detectors.color import HUES, ColorDetector


def _frames(hue: int, saturation: int = 120, value: int = 120, spread: int = 0) -> list[np.ndarray]:
    """Return noisy frames with a sheet of a colour, in OpenCV's units, in the middle."""
    rng = np.random.default_rng(1)
    frames = []
    for _ in range(5):
        hsv = np.full((240, 320, 3), (0, 0, 140), np.uint8)
        sheet = np.array([hue, saturation, value]) + rng.normal(0, (spread, 6, 6), (100, 80, 3))
        sheet[..., 0] %= 180
        hsv[70:170, 120:200] = np.clip(sheet, 0, 255)
        frames.append(cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR))
    return frames


@pytest.mark.parametrize("hue", [0, 5, 40, 90, 150, 178])
def test_what_was_learned_is_found(hue):
    frames = _frames(hue, saturation=90)  # too pale for the usual values
    name, shade, error_deg = learn(frames)
    assert abs((shade.hue_deg - 2 * hue + 180) % 360 - 180) < 4
    assert error_deg < 1
    detector = ColorDetector(name, **shade.model_dump())
    assert all(detector.detect(frame)[0].box == pytest.approx((120, 70, 80, 100), abs=3) for frame in frames)
    assert not any(ColorDetector(each).detect(frames[0]) for each in HUES)


def test_a_name_is_kept_in_odd_light():
    frames = _frames(12)  # as orange as orange is by day
    assert learn(frames)[0] == "orange"
    assert learn(frames, "red")[0] == "red"


@pytest.mark.parametrize(
    ("frames", "color", "said"),
    [
        (_frames(60, saturation=30), None, "no strong colour"),
        (_frames(60, spread=25), None, "several colours"),
        (_frames(60), "red", "not red"),
    ],
)
def test_an_unsuitable_colour_is_refused(frames, color, said):
    with pytest.raises(CalibrationRefused, match=said):
        learn(frames, color)
