"""A visual gyroscope: how far the camera turned between two frames, from how far what it sees moved.

Corners of the first frame are followed into the second one by the optical flow of Lucas and Kanade. When the camera
turns, all of them move by the same angle; when it drives, those of near things move outwards as well. The turn is the
median, if most corners agree with it.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image
from nxtdrive.vision.geometry import Pinhole

WIDTH_PX = 160
"""Frames are brought to this width."""
SOFTNESS_PX = 1.0
"""Standard deviation of the blur that removes noise."""
CORNERS, QUALITY, APART_PX = 80, 0.02, 5
"""Largest number of corners, least quality of one as a share of the best one's, and how far they are apart."""
FEWEST = 10
"""Fewer corners show nothing."""
WINDOW_PX, LEVELS = 15, 3
"""Size of the pattern that is followed, and how often the frames are halved for large motions."""
RETURN_PX = 1.0
"""A corner that is followed there and back ends no farther from where it began."""
AGREE_PX, AGREE_PER_PX = 1.0, 0.05
"""A corner agrees with the median if it moves by no more or less than this, and this for each pixel that it is aside of
the middle: when the camera drives forward, those move outwards."""
AGREE_SHARE = 0.5
"""At least this share of all corners must."""

Array = NDArray[np.float32]


class VisualGyroscope:
    """Measures the turn of a camera from one frame to the next."""

    def __init__(self) -> None:
        self._before: Image | None = None

    def turned_deg(self, image: Image, pinhole: Pinhole) -> float | None:
        """Return how far the camera turned since the frame of the last call, degrees, positive right.

        Args:
            image: The frame, (height, width, 3) BGR.
            pinhole: Geometry of the frame.

        Returns:
            None for the first frame, and where the frames do not show it: blurred, dark, of too little in common, or
            with much that moves.
        """
        before, now = self._before, _prepared(image, *_even_bearings(pinhole))
        self._before = now
        if before is None or before.shape != now.shape:
            return None
        moved_px = _moved_px(before, now)
        return None if moved_px is None else -moved_px * _step_deg(pinhole)


def _prepared(image: Image, u: Array, v: Array) -> Image:
    """Return a small grey copy in which each column is as many degrees wide as any other."""
    height = len(u)
    small = cv2.resize(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    even = cv2.remap(small, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.GaussianBlur(even, (0, 0), SOFTNESS_PX), np.uint8)


def _step_deg(pinhole: Pinhole) -> float:
    """Return how many degrees a column of the small copy is wide."""
    return -2.0 * pinhole.bearing_deg(0.0) / WIDTH_PX


@lru_cache(maxsize=4)
def _even_bearings(pinhole: Pinhole) -> tuple[Array, Array]:
    """Return where in a frame of `WIDTH_PX` the pixels of the small copy are: columns and rows."""
    small = pinhole.resized(WIDTH_PX)
    height = min(max(1, round(WIDTH_PX * pinhole.aspect)), WIDTH_PX)  # how high it is shown does not matter
    bearings = np.radians((np.arange(WIDTH_PX) - (WIDTH_PX - 1) / 2) * _step_deg(pinhole))
    columns = small.focal_px * np.tan(bearings) + (WIDTH_PX - 1) / 2
    u, v = np.meshgrid(columns.astype(np.float32), np.arange(height, dtype=np.float32))
    return u, v


def _moved_px(before: Image, now: Image) -> float | None:
    """Return how far most corners moved to the right, or None if they disagree."""
    corners = np.array(cv2.goodFeaturesToTrack(before, CORNERS, QUALITY, APART_PX), np.float32, ndmin=3)
    if len(corners) < FEWEST:
        return None
    there, found = _followed(before, now, corners)
    back, returned = _followed(now, before, there)
    kept = found & returned & (np.abs(back - corners).max(axis=(1, 2)) < RETURN_PX)
    if kept.sum() < FEWEST:
        return None
    moved = (there - corners)[kept, 0, 0]
    aside = np.abs(corners[kept, 0, 0] - (WIDTH_PX - 1) / 2)
    median = float(np.median(moved))
    agree = np.count_nonzero(np.abs(moved - median) < AGREE_PX + AGREE_PER_PX * aside)
    return median if agree >= AGREE_SHARE * len(corners) else None


def _followed(one: Image, other: Image, corners: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return where corners of one frame are in the other, and which of them were found."""
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        one, other, corners, np.empty_like(corners), winSize=(WINDOW_PX, WINDOW_PX), maxLevel=LEVELS
    )
    return np.asarray(there, np.float32), found.ravel() == 1
