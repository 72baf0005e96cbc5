"""Compares a part of a frame with a picture in colour, as a camera in bad light shows it.

Exposure and white balance change the gain of each colour channel, too much light cuts values at white, and glare hides
part of the print in white. So the gains are estimated first, the picture is cut at white as the frame is, and white
places that the picture does not explain are left out. What remains is correlated.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.scaling import at_height

WHITE = 243.0
"""A pixel whose channels are all above is overexposed; noise and JPEG keep some of those below 255."""

GAIN_RATIO = 2.5
"""The gains of two colour channels differ by no more: lamps differ by less, other colours by more."""

MOST_GLARE = 0.35
"""Share of the picture that may be left out as glare."""

CUT = 250.0
"""Values from here on may be cut; the gains are measured on the others."""

LEAST_LIT = 0.1
"""Least share of the pixels that must not be cut for the gain of a channel to be measured."""

LEAST_GAIN = 0.12
"""A print in a third of the light, softened by the lens, keeps twice this; walls resemble pictures with less."""

HAZE_COLOR = 20.0
"""What brightens black has this little colour."""

DETAIL_HEIGHT = 24
"""Details are counted at this height in pixels; finer ones are lost some metres away."""

WELL_LIT, MOST_HAZE = 0.8, 90.0
"""Where so few values are cut, black shows no brighter than this in the darkest channel."""


def resemblance(
    seen: NDArray[np.float32], picture: NDArray[np.float32], lit: NDArray[np.float32] | None = None
) -> tuple[float, float]:
    """Return the colour correlation, -1..1, and the share of the picture that was compared, 0..1.

    Args:
        seen: The part of the frame, straightened: (height, width, 3), 0..255.
        picture: The picture at the same size.
        lit: (height, width): 1 where there is no glare, else 0.
    """
    if lit is not None and lit.min() < 0.99:
        expected = _exposed(seen, picture, lit > 0.99)
        shown = (lit > 0.5) | (expected.min(axis=2) >= WHITE - 25)
        share = float(shown.mean())
        if 1 > share >= 1 - MOST_GLARE:
            return _score(seen, expected, shown), share
    everywhere = np.ones(seen.shape[:2], np.bool_)
    return _score(seen, _exposed(seen, picture, everywhere), everywhere), 1.0


def distinctness(picture: Image) -> float:
    """Return how many independent details a picture shows: the effective number of waves that it consists of.

    Chance matches a picture of few waves more often: a sunset is like any bright spot above something dark.
    """
    gray = cv2.cvtColor(at_height(picture, DETAIL_HEIGHT), cv2.COLOR_BGR2GRAY).astype(np.float64)
    power = np.abs(np.fft.fft2(gray - gray.mean())) ** 2
    return float(power.sum() ** 2 / max(1e-9, float((power**2).sum())))


def _exposed(seen: NDArray[np.float32], picture: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the picture with the gains and the haze of the frame, cut at white; black where no camera shows it so."""
    lit = where[:, :, None] & (seen < CUT)
    shares = lit.mean(axis=(0, 1))
    weights = lit / np.maximum(lit.sum(axis=(0, 1)), 1)
    mean_picture, mean_seen = (picture * weights).sum(axis=(0, 1)), (seen * weights).sum(axis=(0, 1))
    spread = ((picture - mean_picture) ** 2 * weights).sum(axis=(0, 1))
    measured = (shares >= LEAST_LIT) & (spread >= 1.0)
    if not measured.any():
        return picture
    shared = ((picture - mean_picture) * (seen - mean_seen) * weights).sum(axis=(0, 1))
    gains = shared / np.maximum(spread, 1.0)
    # A channel that is cut is measured worst: its brightest values are missing.
    best = measured & (shares >= shares[measured].max() - 0.1)
    offsets = mean_seen - gains * mean_picture
    haze = float(np.median(offsets[best]))
    if float(np.median(gains[best])) < LEAST_GAIN or (shares.min() > WELL_LIT and haze > MOST_HAZE):
        return np.zeros_like(picture)
    offsets = offsets.clip(haze - HAZE_COLOR, haze + HAZE_COLOR)
    power = np.maximum((picture**2 * weights).sum(axis=(0, 1)), 1.0)
    gains = (picture * (seen - offsets) * weights).sum(axis=(0, 1)) / power
    typical = float(np.median(gains[best]))
    gains = np.where(measured, gains, typical).clip(typical / GAIN_RATIO, typical * GAIN_RATIO)
    return np.asarray((picture * gains + offsets).clip(0, 255), np.float32)


def _score(seen: NDArray[np.float32], expected: NDArray[np.float32], where: NDArray[np.bool_]) -> float:
    """Return the root of the share of the frame's contrast that the picture explains, with the sign of the rest."""
    a, b = seen[where], expected[where]
    contrast = float(((a - a.mean(axis=0)) ** 2).sum()) + a.size  # and one gray level
    explained = 1 - float(((a - b) ** 2).sum()) / contrast
    return math.copysign(math.sqrt(min(1.0, abs(explained))), explained)
