"""Scale pictures down: to a height, or to at most a width."""

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
        image: Grey or in colour.
        height: Pixels.
        stretch: Factor of the width that belongs to the height.
    """
    width = max(NARROWEST_PX, round(height * stretch * image.shape[1] / image.shape[0]))
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), image.dtype)


def at_most_wide(image: NDArray[Value], width: int) -> tuple[NDArray[Value], float]:
    """Return an image that is reduced to a width in pixels if it is wider, its values averaged, and its reduction."""
    reduction = max(1.0, image.shape[1] / width)
    if reduction == 1.0:
        return image, reduction
    size = (round(image.shape[1] / reduction), max(1, round(image.shape[0] / reduction)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), image.dtype), reduction
