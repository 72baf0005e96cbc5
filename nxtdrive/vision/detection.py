"""Detections, and the protocol of all detectors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from behaviors.ports import Cut

Image = NDArray[np.uint8]
"""An image: (height, width, 3) in OpenCV's order blue, green, red, or (height, width) in grey."""

Box = tuple[int, int, int, int]
"""Left, top, width, height in pixels. The box of a target at the edge may extend beyond the frame."""

Quad = tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]
"""Corners (u, v) in pixels: top left, top right, bottom right, bottom left, as the target hangs."""

SAME_OVERLAP = 0.3
"""Detections whose boxes overlap at least this much, as `overlap` computes it, are of one place."""


@dataclass(frozen=True, slots=True)
class Detection:
    """One place in a frame where a detector finds its target.

    Attributes:
        box: Upright box around the whole target; around the visible part, where it is cut off and not completed.
        score: Confidence 0..1; comparable only within one kind of detector.
        quad: The four corners, if the detector determines them; distance and bearing are then computed from these.
        cut: Sides of the frame at which the box ends because the frame does; see `nxtdrive.vision.cut_off`.
        bound: Whether the target is at least as large as the box, and its size is not known.
    """

    box: Box
    score: float
    quad: Quad | None = None
    cut: Cut = Cut.NONE
    bound: bool = False

    @property
    def centre(self) -> tuple[float, float]:
        """Centre of the box (u, v) in pixels."""
        left, top, width, height = self.box
        return left + width / 2, top + height / 2


class Detector(Protocol):
    """Finds one target in one image. Stateless between calls: the same image gives the same answer."""

    def detect(self, image: Image) -> list[Detection]:
        """Return all places where the target is found in the BGR `image`, best first."""
        ...


@runtime_checkable
class Described(Protocol):
    """A detector with a description."""

    def description(self) -> Mapping[str, str]:
        """Return texts on what it is and where it comes from, by title."""
        ...


@dataclass(frozen=True, slots=True)
class TargetDetector:
    """A detector together with the real size of its target.

    Attributes:
        detector: Finds the target.
        height_mm: Real height of the part that the detector's box encloses, millimetres.
    """

    detector: Detector
    height_mm: float


def box_of(quad: Quad) -> Box:
    """Return the upright box around a quad, rounded to whole pixels."""
    us, vs = [u for u, _ in quad], [v for _, v in quad]
    left, top = round(min(us)), round(min(vs))
    return left, top, round(max(us)) - left, round(max(vs)) - top


def quad_of(corners: NDArray[Any]) -> Quad:
    """Return corners, (4, 2), the columns u and v in pixels, as a quad."""
    a, b, c, d = ((float(u), float(v)) for u, v in corners)
    return a, b, c, d


def upright_quad_of(corners: NDArray[Any]) -> Quad:
    """Return the corners of a square target, (4, 2), clockwise from the one that is at the top left in the frame.

    A sheet may hang turned, and a square one does not show which of its sides should be up.
    """
    return quad_of(np.roll(corners, -int(np.argmin(corners.sum(axis=1))), axis=0))


def overlap(a: Box, b: Box) -> float:
    """Return the intersection over union of two boxes, 0..1."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    shared = width * height
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def distinct(detections: list[Detection]) -> list[Detection]:
    """Return the best of every group of overlapping detections, best first."""
    kept: list[Detection] = []
    for detection in sorted(detections, key=lambda d: -d.score):
        if all(overlap(detection.box, other.box) < SAME_OVERLAP for other in kept):
            kept.append(detection)
    return kept
