"""The differences of a real camera from a level pinhole: tilt and roll, lens distortion, and a rolling shutter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.projection import ImagePlane, Matrix, Pinhole, orientation
from sim_backend.camera.textures import Image

MAX_FRAME_TURN_DEG = 8.0
"""Largest turn of the camera while it reads a frame that is rendered."""

Share = TypeVar("Share", float, Matrix)
Maps = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True, slots=True)
class Optics:
    """How a camera differs from a pinhole with a global shutter.

    Attributes:
        distortion_k1: First radial coefficient, as in OpenCV: a point at the distance r from the optical axis, in focal
            lengths, appears at r (1 + k1 r²). Negative is a barrel.
        readout_s: Time from the exposure of the first row to that of the last.
    """

    distortion_k1: float = 0.0
    readout_s: float = 0.0

    def distorted(self, x: Share, y: Share) -> tuple[Share, Share]:
        """Return where a point of the image appears, both in focal lengths from the optical axis."""
        stretch = self.stretch(x * x + y * y)
        return x * stretch, y * stretch

    def stretch(self, square: Share) -> Share:
        """Return the factor by which the lens moves a point away from the optical axis, by its squared distance.

        Beyond `farthest` it stays the same, so that points that do not appear stay outside the frame.
        """
        inner: Share = np.minimum(square, self.farthest**2)
        return 1.0 + self.distortion_k1 * inner

    @property
    def farthest(self) -> float:
        """Distance from the optical axis, in focal lengths, beyond which the polynomial turns back; nothing appears."""
        return math.inf if self.distortion_k1 >= 0 else math.sqrt(1 / (-3 * self.distortion_k1))

    def row_turn_deg(self, row_share: Share, turn_rate_deg_s: float) -> Share:
        """Return how far the camera has turned when a row is exposed, relative to the middle row; shares are 0..1."""
        return turn_rate_deg_s * self.readout_s * (row_share - 0.5)


PINHOLE_OPTICS = Optics()


class CameraWarp:
    """Turns images of a level camera into those of a real one at the same place.

    Args:
        camera: The camera's frames and focal length.
        optics: Its lens and shutter.
        tilt_deg: Elevation of its axis.
        roll_deg: Rotation about its axis, clockwise as seen from behind.

    Attributes:
        window: The part of the level camera's image that is needed.

    Raises:
        ValueError: The camera sees the zenith or the nadir, which no level camera does.
    """

    def __init__(self, camera: Pinhole, optics: Optics, tilt_deg: float, roll_deg: float) -> None:
        self._camera, self._optics = camera, optics
        self._rays = _rays(camera, optics, orientation(tilt_deg, roll_deg))
        if float(self._rays[..., 2].min()) < 0.1:
            raise ValueError("the camera sees what is right above or below it; lower tilt_deg or hfov_deg")
        swing_deg = MAX_FRAME_TURN_DEG if optics.readout_s else 0.0
        ends = [_turned(self._rays, turn_deg) for turn_deg in (-swing_deg, swing_deg)]
        points = np.concatenate([rays[..., :2] / np.maximum(rays[..., 2:], 0.05) for rays in ends])
        (left, top), (right, bottom) = (
            np.floor(points.min(axis=(0, 1)) * camera.focal_px) - 1,
            np.ceil(points.max(axis=(0, 1)) * camera.focal_px) + 1,
        )
        size = int(right - left) + 1, int(bottom - top) + 1
        self.window = ImagePlane(*size, camera.focal_px, (-float(left), -float(top)))
        self._still = self._maps(self._rays)

    def apply(self, image: Image, turn_rate_deg_s: float) -> Image:
        """Return the frame, from the level camera's image in the middle of the exposure."""
        maps = self._still
        if self._optics.readout_s and turn_rate_deg_s:
            shares = (np.arange(self._camera.height) + 0.5) / self._camera.height
            turns_deg = self._optics.row_turn_deg(shares, turn_rate_deg_s)
            maps = self._maps(_turned(self._rays, np.clip(turns_deg, -MAX_FRAME_TURN_DEG, MAX_FRAME_TURN_DEG)[:, None]))
        return np.asarray(cv2.remap(image, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.uint8)

    def _maps(self, rays: Matrix) -> Maps:
        """Return columns and rows of the window for each pixel of the frame."""
        centre_u, centre_v = self.window.centre_px
        scale = self.window.focal_px / np.maximum(rays[..., 2], 0.05)
        columns, rows = rays[..., 0] * scale + centre_u, rays[..., 1] * scale + centre_v
        return columns.astype(np.float32), rows.astype(np.float32)


def _rays(camera: Pinhole, optics: Optics, turn: Matrix) -> Matrix:
    """Return the rays of all pixels, (height, width, 3), along the axes of a level camera: right, down, forward."""
    centre_u, centre_v = camera.centre_px
    columns = (np.arange(camera.width) - centre_u) / camera.focal_px
    rows = (np.arange(camera.height) - centre_v) / camera.focal_px
    x, y = np.meshgrid(columns, rows)
    shown = np.hypot(x, y)
    real = shown.copy()
    for _ in range(8 if optics.distortion_k1 else 0):  # Newton's method
        square = optics.distortion_k1 * real**2
        real = np.clip(real - (real * (1 + square) - shown) / np.maximum(1 + 3 * square, 0.05), 0.0, optics.farthest)
    scale = np.divide(real, shown, out=np.ones_like(real), where=shown > 0)
    return np.asarray(np.stack([x * scale, y * scale, np.ones_like(x)], axis=-1) @ turn, np.float64)


def _turned(rays: Matrix, turn_deg: float | Matrix) -> Matrix:
    """Return the rays of a camera that has turned to the right."""
    turn = np.radians(turn_deg)
    cos, sin = np.cos(turn), np.sin(turn)
    right, down, forward = rays[..., 0], rays[..., 1], rays[..., 2]
    return np.stack([right * cos + forward * sin, down, forward * cos - right * sin], axis=-1)
