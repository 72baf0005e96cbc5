"""Pictures for which a simpler detector is better are recognised, and no others."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import segno

from nxtdrive.cli.main import DONE, main
from nxtdrive.mission.simpler_detector import simpler_detector

SIDE_PX = 240


def _on_paper(code: np.ndarray) -> np.ndarray:
    """A code in the middle of a grey sheet."""
    image = np.full((SIDE_PX, SIDE_PX + 80, 3), 210, np.uint8)
    side = SIDE_PX * 3 // 4
    large = cv2.resize(code, (side, side), interpolation=cv2.INTER_NEAREST)
    image[30 : 30 + side, 70 : 70 + side] = cv2.cvtColor(large, cv2.COLOR_GRAY2BGR)
    return image


def _qr(text: str) -> np.ndarray:
    return _on_paper(cv2.copyMakeBorder(cv2.QRCodeEncoder.create().encode(text), *(4 * [2]), 0, value=255))


def _asian(text: str, mode: str) -> np.ndarray:
    code = segno.make(text, mode=mode, micro=False)
    return _on_paper(np.array([[255 * (1 - bit) for bit in row] for row in code.matrix_iter(border=2)], np.uint8))


def _marker() -> np.ndarray:
    code = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), 7, 120)
    return _on_paper(cv2.copyMakeBorder(code, *(4 * [20]), 0, value=255))


def _ball(radius_px: int) -> np.ndarray:
    image = np.full((SIDE_PX, SIDE_PX, 3), (190, 200, 205), np.uint8)
    return cv2.circle(image, (120, 120), radius_px, (20, 20, 200), -1)


@pytest.mark.parametrize(
    ("image", "keys"),
    [
        (_qr('say "7"'), 'detector = "qr" and text = "say \\"7\\""'),
        (_asian("点茗", "hanzi"), ""),  # which OpenCV cannot decode
        (_asian("日本", "kanji"), 'detector = "qr" and text = "日本"'),
        (_marker(), 'detector = "marker", family = "aruco_4x4_50" and id = 7'),
        (_ball(60), 'detector = "color" and color = "red"'),
        (_ball(20), ""),
        (cv2.rectangle(_ball(60), (0, 0), (240, 40), (200, 20, 20), -1), ""),
        (np.zeros((1, 6000, 3), np.uint8), ""),
    ],
)
def test_the_keys_of_the_detector_that_fits_are_named(image, keys):
    told = simpler_detector(image)
    assert keys in told
    assert bool(told) is bool(keys)


def test_a_photograph_has_no_simpler_detector():
    noise = np.random.default_rng(1).integers(0, 256, (SIDE_PX, SIDE_PX, 3), np.uint8)
    assert simpler_detector(cv2.resize(noise[::12, ::12], (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_CUBIC)) == ""


@pytest.mark.slow
def test_a_new_mission_and_its_check_give_the_hint(here: Path, capsys, printed):
    cv2.imwrite("ball.png", _ball(80))
    assert main(["mission", "new", "--picture", "ball.png", "--height-mm", "200"]) == DONE
    assert 'hint: the picture shows something plain red: a target with detector = "color"' in capsys.readouterr().out
    assert "warning: target.ball: the picture shows something plain red" in printed("mission", "check", "ball.toml")
