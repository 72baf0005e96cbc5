"""Compute the score that a picture reaches by accident, so that a higher one can be required.

Coarse features are matched by accident: a dark object in front of a bright wall resembles every such picture, and a
picture of few waves resembles stripes and gradients. Fine shapes and colours are hardly ever matched. So each picture
has its own threshold, at each height at which it is compared. Source of the constants: docs/ranges.md, 1.7.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.scaling import at_height

DETAIL_HEIGHT = 24
"""Details are counted at this height in pixels; finer ones are lost some metres away."""

COARSE_WAVES = 3
"""The coarse part of a picture: this many cosines along each side, the constant among them."""

COARSE_MATCHED, FINE_MATCHED = 0.9, 0.3
"""Chance explains at most these shares of a picture's coarse contrast and of the rest."""

FEW_WAVES, FEW_PIXELS = 0.6, 5.0
"""Chance adds these to a score, divided by the number of details and of pixels that are compared."""

MARGIN = 0.035
"""How far above chance a score must be."""

CORE_LESS = 0.02
"""The middle of a picture is searched for in few places, so accidental matches are rarer."""


def distinctness(picture: Image) -> float:
    """Return how many independent details a picture shows: the effective number of waves that it consists of."""
    gray = cv2.cvtColor(at_height(picture, DETAIL_HEIGHT), cv2.COLOR_BGR2GRAY).astype(np.float64)
    power = np.abs(np.fft.fft2(gray - gray.mean())) ** 2
    return float(power.sum() ** 2 / max(1e-9, float((power**2).sum())))


def coarseness(picture: NDArray[np.float32]) -> float:
    """Return the share, 0..1, of a picture's contrast that a few broad waves of grey explain.

    Args:
        picture: (height, width, 3).
    """
    rows, columns = _cosines(picture.shape[0]), _cosines(picture.shape[1])
    centred = picture - picture.mean(axis=(0, 1))
    coarse = rows.T @ (rows @ centred.mean(axis=2) @ columns.T) @ columns
    shared = np.maximum((centred * coarse[:, :, None]).sum(axis=(0, 1)), 0)  # no light inverts a channel
    power = float((coarse**2).sum()) * float((centred**2).sum())
    return float((shared**2).sum()) / max(1e-6, power)


def min_score(coarse: float, waves: float, area: float, *, core: bool) -> float:
    """Return the score from which on a place counts as the picture.

    Args:
        coarse: The picture's `coarseness` at the height of the comparison.
        waves: Its `distinctness`.
        area: Size of the part that can be compared, in square pixels: few pixels match by chance more often.
        core: Only the middle of the picture was compared.
    """
    matched = math.sqrt(COARSE_MATCHED * coarse + FINE_MATCHED * (1 - coarse))
    few = FEW_WAVES * (1 - math.sqrt(coarse)) / waves + FEW_PIXELS / area
    return matched + few + MARGIN - (CORE_LESS if core else 0.0)


def _cosines(length: int) -> NDArray[np.float64]:
    """Return the first waves of the discrete cosine transform, one per row, each of norm 1."""
    waves = np.cos(math.pi * np.outer(np.arange(COARSE_WAVES), np.arange(length) + 0.5) / length)
    return np.asarray(waves / np.linalg.norm(waves, axis=1, keepdims=True))
