"""Compare a part of a frame with a picture in colour, as a camera in bad light shows it.

Exposure and white balance change the gain of each colour channel, too much light cuts values at white, and glare hides
part of the print in white. So the gains are estimated first, the picture is cut at white as the frame is, and white
places that the picture does not explain are left out. What remains is correlated.
"""

from __future__ import annotations

import math
import statistics
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

WHITE = 243.0
"""A pixel whose channels are all above is overexposed; noise and JPEG keep some of those below 255."""

GAIN_RATIO = 2.5
"""The gains of two colour channels differ by no more: lamps differ by less, other colours by more."""

GLARE, RIM = 203.0, np.ones((3, 3), np.uint8)
"""Where all channels are above, and next to it, the picture may be hidden by glare, which has soft edges."""

MAX_GLARE = 0.5
"""Share of the picture that may be left out as glare."""

CUT = 250.0
"""Values from here on may be cut; the gains are measured on the others."""

FITS, HARDLY_CUT = 3, 0.98
"""Gains are measured this many times where less than this share of the values is below `CUT`."""

MIN_LIT = 0.1
"""Minimum share of the pixels that must not be cut for the gain of a channel to be measured."""

MIN_GAIN = 0.12
"""A print in a third of the light, softened by the lens, keeps twice this; walls resemble pictures with less."""

HAZE_COLOR = 20.0
"""Haze, which brightens black, has this little colour."""

WELL_LIT, MAX_HAZE = 0.8, 90.0
"""Where so few values are cut, black shows no brighter than this in the darkest channel."""


class Resemblance(NamedTuple):
    """How well a part of a frame resembles a picture.

    Attributes:
        score: The colour correlation, -1..1.
        share: Share of the picture that can be compared: neither glare nor cut, nor white where that may be glare.
        expected: The picture as this frame would show it.
    """

    score: float
    share: float
    expected: NDArray[np.float32]


def resemblance(
    seen: NDArray[np.float32], picture: NDArray[np.float32], inside: NDArray[np.bool_], *, overexposed: bool
) -> Resemblance:
    """Compare a part of the frame with the picture.

    Args:
        seen: The part of the frame, rectified: (height, width, 3), 0..255.
        picture: The picture at the same size.
        inside: Which of the pixels lie inside the frame; only those are compared.
        overexposed: Whether white is the frame's exposure rather than glare.
    """
    bright = cv2.dilate((_darkest(seen) >= GLARE).astype(np.uint8), RIM) > 0
    lit, certain = inside & ~bright, inside
    if lit.mean() < 1 - MAX_GLARE and not overexposed:
        # Glare hides nothing where the picture is white, but that the frame is white there is no evidence.
        lit, certain = inside & ~(bright & (_darkest(picture) < GLARE)), lit
    if lit.mean() < 1 - MAX_GLARE:
        lit, certain = inside, inside
    expected = _exposed(seen, picture, lit)
    darkest = _darkest(expected)
    shown = lit | (inside & (darkest >= WHITE - 25))
    if lit is not inside and (shown == inside).all():
        expected = _exposed(seen, picture, inside)
        darkest = _darkest(expected)
    return Resemblance(_score(seen, expected, shown), float((shown & certain & (darkest < CUT)).mean()), expected)


def _exposed(seen: NDArray[np.float32], picture: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the picture with the gains and the haze of the frame, cut at white; black if no camera has such gains."""
    expected, lit = picture, where[:, :, None] & (seen < CUT)
    for _ in range(FITS if lit.mean() < HARDLY_CUT * where.mean() else 1):
        measured = _measured(seen, picture, lit)
        if measured is None:
            return expected
        gains, offsets = measured
        expected = np.asarray((picture * gains + offsets).clip(0, 255), np.float32)
        # What noise brings across the cut would bend the next fit, so the fit itself says what is cut.
        lit = where[:, :, None] & (expected < CUT)
    return expected


def _measured(
    seen: NDArray[np.float32], picture: NDArray[np.float32], lit: NDArray[np.bool_]
) -> tuple[NDArray[np.floating[Any]], NDArray[np.floating[Any]]] | None:
    """Return gain and offset of each channel, measured on the values that are `lit`; 0 if no camera has such gains."""
    shares = lit.mean(axis=(0, 1))
    weights = lit.astype(np.float32)
    lit_picture = weights * picture
    sums = (lit_picture, weights * seen, lit_picture * picture, lit_picture * seen)
    counts = np.maximum(lit.sum(axis=(0, 1)), 1)
    mean_picture, mean_seen, power, product = (each.sum(axis=(0, 1)) / counts for each in sums)
    spread = power - mean_picture**2
    measured = (shares >= MIN_LIT) & (spread >= 1.0)
    if not measured.any():
        return None
    gains = (product - mean_picture * mean_seen) / np.maximum(spread, 1.0)
    # A channel that is cut is measured worst: its brightest values are missing.
    best = measured & (shares >= shares[measured].max() - 0.1)
    offsets = mean_seen - gains * mean_picture
    haze = _median(offsets[best])
    if _median(gains[best]) < MIN_GAIN or (shares.min() > WELL_LIT and haze > MAX_HAZE):
        return np.zeros_like(gains), np.zeros_like(offsets)
    offsets = offsets.clip(haze - HAZE_COLOR, haze + HAZE_COLOR)
    gains = (product - offsets * mean_picture) / np.maximum(power, 1.0)
    typical = _median(gains[best])
    return np.where(measured, gains, typical).clip(typical / GAIN_RATIO, typical * GAIN_RATIO), offsets


def _score(seen: NDArray[np.float32], expected: NDArray[np.float32], where: NDArray[np.bool_]) -> float:
    """Return the root of the share of the frame's contrast that the picture explains, with the sign of the rest."""
    weights = where[:, :, None].astype(np.float32)
    count = max(1.0, float(where.sum()))
    lit, missed = seen * weights, (seen - expected) * weights
    means = lit.reshape(-1, 3).sum(axis=0) / count
    contrast = float(np.vdot(lit, lit)) - count * float(means @ means) + 3 * count  # and one grey level
    explained = 1 - float(np.vdot(missed, missed)) / contrast
    return math.copysign(math.sqrt(min(1.0, abs(explained))), explained)


def _median(values: NDArray[np.floating[Any]]) -> float:
    """Return the median of up to three values, for which `np.median` takes twenty times as long."""
    return float(statistics.median(values.tolist()))


def _darkest(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the least of the three channels of each pixel."""
    return np.minimum(np.minimum(image[:, :, 0], image[:, :, 1]), image[:, :, 2])
