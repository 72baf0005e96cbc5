"""Scales pictures down to a height."""

from __future__ import annotations

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

NARROWEST_PX = 4
"""No picture becomes narrower, however slim it is."""

Value = TypeVar("Value", np.uint8, np.float32)


def at_height(image: NDArray[Value], height: int, stretch: float = 1.0) -> NDArray[Value]:
    """Return an image at a height in pixels, its values averaged.

    Args:
        image: Gray or in colour.
        height: Pixels.
        stretch: Factor of the width that belongs to the height.
    """
    width = max(NARROWEST_PX, round(height * stretch * image.shape[1] / image.shape[0]))
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), image.dtype)
