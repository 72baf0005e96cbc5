"""A canvas for the pictures in `drawings.py`: smooth shapes, strokes, soft shading. Lengths are in millimetres."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.textures import Color, Image

A4_MM = (210, 297)
"""Width and height. Source: ISO 216."""
MIDDLE = A4_MM[0] / 2

Shape = NDArray[np.float64]
"""Corners of a polygon, (n, 2), in millimetres from the upper left of the sheet."""

Mask = NDArray[np.float32]

_OVERSAMPLING = 2


def polygon(*points: tuple[float, float]) -> Shape:
    """Return a shape with straight sides."""
    return np.array(points, np.float64)


def smooth(*points: tuple[float, float]) -> Shape:
    """Return a closed curve through the points (Catmull-Rom)."""
    return _catmull_rom(np.array(points, np.float64), closed=True)


def curve(*points: tuple[float, float]) -> Shape:
    """Return an open curve through the points, for `Canvas.stroke`."""
    return _catmull_rom(np.array(points, np.float64), closed=False)


def ellipse(x: float, y: float, radius_x: float, radius_y: float, turn_deg: float = 0.0) -> Shape:
    """Return an ellipse around (x, y), turned clockwise."""
    angles = np.linspace(0.0, 2 * math.pi, 96, endpoint=False)
    turn = math.radians(turn_deg)
    along, across = radius_x * np.cos(angles), radius_y * np.sin(angles)
    return np.stack(
        [x + along * math.cos(turn) - across * math.sin(turn), y + along * math.sin(turn) + across * math.cos(turn)],
        axis=1,
    )


def mirrored(shape: Shape) -> Shape:
    """Return the shape mirrored at the vertical line through the middle of the sheet."""
    return np.stack([2 * MIDDLE - shape[:, 0], shape[:, 1]], axis=1)


SHEET = polygon((0, 0), (210, 0), (210, 297), (0, 297))


class Canvas:
    """A sheet to draw on; later strokes cover earlier ones.

    Args:
        color: Blue, green, red of the paper.
        size_mm: Width and height of the sheet.
        px_per_mm: Resolution of the finished picture.
    """

    def __init__(self, color: Color, size_mm: tuple[int, int] = A4_MM, px_per_mm: int = 2) -> None:
        self._size_px = size_mm[0] * px_per_mm, size_mm[1] * px_per_mm
        self._scale = px_per_mm * _OVERSAMPLING
        shape = (size_mm[1] * self._scale, size_mm[0] * self._scale, 3)
        self._pixels = np.full(shape, color, np.float32)

    def fill(
        self, shape: Shape, color: Color, *, opacity: float = 1.0, soft_mm: float = 0.0, inside: Shape | None = None
    ) -> None:
        """Paint a shape.

        Args:
            shape: What to paint.
            color: Blue, green, red.
            opacity: 0..1, how much it covers.
            soft_mm: Blur of its edge (standard deviation).
            inside: Paint only within this other shape.
        """
        self._apply(self._soften(self._mask(shape), soft_mm), color, opacity, inside)

    def stroke(
        self,
        line: Shape,
        color: Color,
        width_mm: float,
        *,
        opacity: float = 1.0,
        soft_mm: float = 0.0,
        inside: Shape | None = None,
    ) -> None:
        """Paint along a line with a round brush of `width_mm`; the rest as in `fill`."""
        mask = np.zeros(self._pixels.shape[:2], np.uint8)
        thickness = max(1, round(width_mm * self._scale))
        cv2.polylines(mask, [self._fixed_point(line)], False, 255, thickness, cv2.LINE_AA, shift=4)
        self._apply(self._soften(mask.astype(np.float32) / 255.0, soft_mm), color, opacity, inside)

    def gradient(self, shape: Shape, upper: Color, lower: Color) -> None:
        """Paint a shape that changes from one colour at its top to another at its bottom."""
        top, bottom = float(shape[:, 1].min()), float(shape[:, 1].max())
        rows = (np.arange(self._pixels.shape[0]) / self._scale - top) / (bottom - top)
        share = np.clip(rows, 0.0, 1.0).astype(np.float32)[:, None, None]
        colors = (1.0 - share) * np.array(upper, np.float32) + share * np.array(lower, np.float32)
        mask = self._mask(shape)[:, :, None]
        self._pixels += mask * (colors - self._pixels)

    def picture(self) -> Image:
        """Return the finished picture: (height, width, 3), blue, green, red."""
        small = cv2.resize(self._pixels, self._size_px, interpolation=cv2.INTER_AREA)
        return np.clip(np.rint(small), 0, 255).astype(np.uint8)

    def _fixed_point(self, shape: Shape) -> NDArray[np.int32]:
        """Return corners in sixteenths of a pixel, as OpenCV draws with shift=4."""
        return np.rint((shape * self._scale - 0.5) * 16).astype(np.int32)

    def _mask(self, shape: Shape) -> Mask:
        mask = np.zeros(self._pixels.shape[:2], np.uint8)
        cv2.fillPoly(mask, [self._fixed_point(shape)], 255, cv2.LINE_AA, shift=4)
        return mask.astype(np.float32) / np.float32(255.0)

    def _soften(self, mask: Mask, soft_mm: float) -> Mask:
        """Blur a mask, at reduced size for speed: the result is smooth anyway."""
        if soft_mm <= 0:
            return mask
        height, width = mask.shape
        shrink = max(1, min(8, int(soft_mm * self._scale / 3)))
        small = cv2.resize(mask, (width // shrink, height // shrink), interpolation=cv2.INTER_AREA)
        small = cv2.GaussianBlur(small, (0, 0), soft_mm * self._scale / shrink)
        return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR), np.float32)

    def _apply(self, mask: Mask, color: Color, opacity: float, inside: Shape | None) -> None:
        if inside is not None:
            mask = mask * self._mask(inside)
        left, top, width, height = cv2.boundingRect((mask > 0.0).view(np.uint8))
        touched = (slice(top, top + height), slice(left, left + width))
        cover = (mask[touched] * np.float32(opacity))[:, :, None]
        self._pixels[touched] += cover * (np.array(color, np.float32) - self._pixels[touched])


def _catmull_rom(points: Shape, *, closed: bool) -> Shape:
    """Return points on the Catmull-Rom curve, 16 for each span."""
    count = len(points)
    spans = count if closed else count - 1
    index = np.arange(-1, spans + 2)
    knots = points[index % count] if closed else points[np.clip(index, 0, count - 1)]
    t = np.linspace(0.0, 1.0, 16, endpoint=False)[:, None]
    pieces = []
    for before, start, stop, after in zip(knots[:-3], knots[1:-2], knots[2:-1], knots[3:], strict=True):
        slope0, slope1 = (stop - before) / 2, (after - start) / 2
        square, cube = t**2, t**3
        pieces.append(
            (2 * cube - 3 * square + 1) * start
            + (cube - 2 * square + t) * slope0
            + (3 * square - 2 * cube) * stop
            + (cube - square) * slope1
        )
    if not closed:
        pieces.append(points[-1:])
    return np.concatenate(pieces)
