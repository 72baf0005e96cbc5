"""What a detector finds, and the shape all detectors share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
"""A picture: (height, width, 3) in OpenCV's order blue, green, red, or (height, width) in gray."""

Box = tuple[int, int, int, int]
"""Left, top, width, height in pixels. A target that is cut by the edge of the frame may reach beyond it."""

Quad = tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]
"""Corners (u, v) in pixels: top left, top right, bottom right, bottom left as seen on the upright target."""


@dataclass(frozen=True, slots=True)
class Detection:
    """One place in a frame where a detector sees its target.

    Attributes:
        box: The whole target, upright.
        score: 0..1 as the detector grades it; comparable only within one kind of detector.
        quad: The four corners, when the detector knows them; then distance and bearing are taken from these.
    """

    box: Box
    score: float
    quad: Quad | None = None

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the box (u, v) in pixels."""
        left, top, width, height = self.box
        return left + width / 2, top + height / 2


class Detector(Protocol):
    """Finds one target in one picture. Stateless between calls: the same image gives the same answer."""

    def detect(self, image: Image) -> list[Detection]:
        """All places where the target is seen in the BGR `image`, best first; empty when there is none."""
        ...


@dataclass(frozen=True, slots=True)
class TargetDetector:
    """A detector together with how large its target is in the world.

    Attributes:
        detector: Finds the target.
        height_mm: Real height of what the detector puts its box around, in millimetres.
    """

    detector: Detector
    height_mm: float


def box_of(quad: Quad) -> Box:
    """The upright box around a quad, rounded to whole pixels."""
    us, vs = [u for u, _ in quad], [v for _, v in quad]
    left, top = round(min(us)), round(min(vs))
    return left, top, round(max(us)) - left, round(max(vs)) - top


def overlap(a: Box, b: Box) -> float:
    """Intersection over union of two boxes, 0..1."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    shared = width * height
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)
