"""Cameras without lens distortion, and the axes of a tilted and rolled one.

Pixel (0, 0) is the *centre* of the upper left pixel; the optical axis meets the image at ((w - 1) / 2, (h - 1) / 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A pinhole camera's image size and focal length.

    Attributes:
        width: Image width in pixels.
        height: Image height in pixels.
        hfov_deg: Horizontal field of view between the left and right edges of the image.
    """

    width: int
    height: int
    hfov_deg: float

    @property
    def focal_px(self) -> float:
        """Focal length in pixels."""
        return self.width / 2 / math.tan(math.radians(self.hfov_deg / 2))

    @property
    def centre_px(self) -> tuple[float, float]:
        """Image point of the optical axis: column, row."""
        return (self.width - 1) / 2, (self.height - 1) / 2


@dataclass(frozen=True, slots=True)
class ImagePlane:
    """A window of the image plane of a level camera, whose optical axis need not pass through its middle.

    Attributes:
        width: Width in pixels.
        height: Height in pixels.
        focal_px: Focal length in pixels.
        centre_px: Image point of the optical axis: column, row; it may lie outside the window.
    """

    width: int
    height: int
    focal_px: float
    centre_px: tuple[float, float]


def orientation(tilt_deg: float, roll_deg: float) -> Matrix:
    """Return the rotation from a level camera's axes right, down, forward to those of one tilted up, then rolled."""
    tilt, roll = math.radians(tilt_deg), math.radians(roll_deg)
    right, down = np.array([1.0, 0.0, 0.0]), np.array([0.0, math.cos(tilt), math.sin(tilt)])
    forward = np.array([0.0, -math.sin(tilt), math.cos(tilt)])
    cos, sin = math.cos(roll), math.sin(roll)
    return np.array([cos * right + sin * down, cos * down - sin * right, forward])
