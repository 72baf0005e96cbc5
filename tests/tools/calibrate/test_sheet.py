"""The sheet of markers: where it is found in a frame."""

from time import thread_time

import cv2
import numpy as np
import pytest

from nxtdrive.tools.calibrate.sheet import SHEET_MM, draw_sheet, find_sheet

SHARE = 0.65
"""Of the frame's width that the sheet fills."""


def frame(width, height):
    """Return a frame of a wall with the sheet, and the middle of the sheet and the pixels of a millimetre in it."""
    size = round(SHARE * width), round(SHARE * width * SHEET_MM[1] / SHEET_MM[0])
    left, top = (width - size[0]) // 2, (height - size[1]) // 2
    wall = np.full((height, width), 120, np.uint8)
    sheet = cv2.resize(np.asarray(draw_sheet()), size, interpolation=cv2.INTER_AREA)
    wall[top : top + size[1], left : left + size[0]] = sheet
    noisy = cv2.GaussianBlur(wall, (0, 0), 0.8) + np.random.default_rng(1).normal(0, 4, wall.shape)
    middle = np.array([left + size[0] / 2, top + size[1] / 2])
    return cv2.cvtColor(noisy.clip(0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR), middle, np.array(size) / SHEET_MM


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1280, 720), (1920, 1080), (2560, 1440), (3840, 2160)])
def test_the_sheet_is_found_where_it_is_in_frames_of_every_size(size):
    image, middle, px_per_mm = frame(*size)
    seen = find_sheet(image)
    assert seen.markers == 6
    assert seen.in_frame_px == pytest.approx(middle + seen.on_sheet_mm * px_per_mm, abs=size[0] / 1000)


def cpu_s(image):
    begun_s = thread_time()
    find_sheet(image)
    return thread_time() - begun_s


@pytest.mark.slow
def test_a_large_frame_takes_hardly_longer_than_one_of_a_webcam_since_the_robot_moves_on_meanwhile():
    webcam, large = (min(cpu_s(frame(*size)[0]) for _ in range(3)) for size in ((640, 480), (3840, 2160)))
    assert large < 10 * webcam
