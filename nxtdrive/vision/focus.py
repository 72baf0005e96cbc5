"""Detect a target near its last position only: in a crop of the frame, shrunk to a size that suits the detectors."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from behaviors.ports import Cut
from nxtdrive.vision.cut_off import marked
from nxtdrive.vision.detection import Box, Detection, Detector, Image, quad_of

TARGET_HEIGHT_PX = 80
"""Larger targets are shrunk to this height before detection; all detectors work well there (docs/ranges.md)."""

MARGIN = 0.7
"""Margin of the crop around the old box on each side, as a share of the box's larger side."""

MIN_MARGIN_PX = 24
"""The margin is at least this wide, so that a far target may move by more than its own small size."""


def detect_near(detector: Detector, image: Image, box: Box) -> list[Detection]:
    """Return the detections in the BGR `image` near `box`, in the image's coordinates, best first.

    A target that extends beyond that part of the image is not returned, since the whole image shows more of it.
    """
    left, top, width, height = box
    margin = max(MIN_MARGIN_PX, round(MARGIN * max(width, height)))
    x0, y0 = max(0, left - margin), max(0, top - margin)
    crop = image[y0 : max(0, top + height + margin), x0 : max(0, left + width + margin)]
    if crop.size == 0:
        return []
    zoom = min(1.0, TARGET_HEIGHT_PX / max(1, height))
    size = (max(1, round(crop.shape[1] * zoom)), max(1, round(crop.shape[0] * zoom)))
    small = crop if zoom == 1 else cv2.resize(crop, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
    stretch_x, stretch_y = crop.shape[1] / small.shape[1], crop.shape[0] / small.shape[0]
    inside = _inside(image, x0, y0, crop)
    near = [one for one in marked(detector.detect(small), small.shape[1], small.shape[0]) if not one.cut & inside]
    return [_placed(found, x0, y0, stretch_x, stretch_y) for found in near]


def _inside(image: Image, x0: int, y0: int, crop: Image) -> Cut:
    """Return the sides of the crop that lie within the image."""
    inside = Cut.LEFT if x0 else Cut.NONE
    inside |= Cut.TOP if y0 else Cut.NONE
    inside |= Cut.RIGHT if x0 + crop.shape[1] < image.shape[1] else Cut.NONE
    return inside | (Cut.BOTTOM if y0 + crop.shape[0] < image.shape[0] else Cut.NONE)


def _placed(found: Detection, x0: int, y0: int, stretch_x: float, stretch_y: float) -> Detection:
    """Convert a detection from the crop's coordinates to the frame's."""
    left, top, width, height = found.box
    box = (
        round(x0 + left * stretch_x),
        round(y0 + top * stretch_y),
        round(width * stretch_x),
        round(height * stretch_y),
    )
    quad = None if found.quad is None else quad_of(np.array(found.quad) * (stretch_x, stretch_y) + (x0, y0))
    return replace(found, box=box, quad=quad)
