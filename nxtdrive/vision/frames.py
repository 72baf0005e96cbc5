"""Convert frames as cameras and videos deliver them to the form that every detector takes."""

from __future__ import annotations

import cv2
import numpy as np

from nxtdrive.vision.detection import Image

MAX_PIXELS = 3840 * 2160
"""A frame with more is reduced: several are kept at a time, and detectors need far fewer."""
LIT = 40
"""The brightest value, of 255, of a frame that shows something; behind a shutter only noise is left."""


def is_black(image: Image) -> bool:
    """Return whether a frame shows nothing: its camera is covered, or there is no light."""
    return int(image.max()) < LIT


def as_frame(image: cv2.typing.MatLike | None) -> Image | None:
    """Return a frame in BGR with 8 bits, of at most `MAX_PIXELS`; None if it is not an image.

    Args:
        image: Grey, BGR, or BGR with transparency; with 8 bits or, from thermal and scientific cameras, 16.
    """
    if image is None or image.ndim not in (2, 3) or not image.size or image.dtype not in (np.uint8, np.uint16):
        return None
    pixels = image.shape[0] * image.shape[1]
    if pixels > MAX_PIXELS:
        scale = (MAX_PIXELS / pixels) ** 0.5
        size = [max(1, int(scale * side)) for side in image.shape[1::-1]]
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    if image.dtype == np.uint16:
        image = cv2.convertScaleAbs(image, alpha=1 / 257)
    channels = 1 if image.ndim == 2 else image.shape[2]
    if channels in (1, 4):
        image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR if channels == 1 else cv2.COLOR_BGRA2BGR)
    elif channels != 3:
        return None
    return image.astype(np.uint8, copy=False)
