"""Correlate templates with a level of a frame's pyramid of which glare hides a part.

Only what is lit counts, of a window and of the template: their means and norms are taken over it. Source: Padfield
2012, "Masked Object Registration in the Fourier Domain", equation 2, for a mask of the frame only.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detectors.alignment import MIN_LIT

FLAT_SD = 1.0
"""Lower bound of a window's contrast, grey levels: only rendered frames have flatter windows."""

MIN_SHOWN = 0.25
"""Lower bound of the share of a template's contrast that counts as lit: smaller parts match by accident."""

SPOTS_APART = np.ones((23, 23), np.uint8)
"""Spots of glare within half of this, about the size of a template, are one: each has its own windows."""

_Spot: TypeAlias = tuple[int, int, int, int]
"""Left, top, right and bottom of a spot of glare, in steps."""


class Footprint:
    """A template of mean 0 and norm 1, and its square, as glare hides them.

    Args:
        gray: The template.
        step: Distance in pixels between the windows.

    Attributes:
        size: Height and width of the template.
        sums: Its sums in squares of that side.
        powers: The same of its square.
    """

    def __init__(self, gray: NDArray[np.float32], step: int) -> None:
        self.size = gray.shape
        self.sums = in_squares(gray, step) * np.float32(step**2)
        self.powers = in_squares(gray * gray, step) * np.float32(step**2)


class _Windows(NamedTuple):
    """The windows of one size near a spot of glare.

    Attributes:
        places: Where they are among all windows.
        hidden: Share of each square of pixels that glare hides.
        lit: Area of each window that is lit, in pixels.
        means: Mean of that.
        norms: Norm of that about its mean; infinite where too little is lit.
    """

    places: tuple[slice, slice]
    hidden: NDArray[np.float32]
    lit: NDArray[np.float32]
    means: NDArray[np.float32]
    norms: NDArray[np.float32]


class LitWindows:
    """The windows of one level.

    Args:
        gray: The level, 0..255.
        lit: 1 where it is to be compared, 0 in glare.
        step: Distance in pixels between the windows.

    Attributes:
        shown: The level about its mean, 0 in glare: what is to be correlated with the templates.
    """

    def __init__(self, gray: NDArray[np.float32], lit: NDArray[np.float32], step: int) -> None:
        about_mean = gray - np.float32((gray * lit).sum() / max(1.0, float(lit.sum())))
        self.shown = about_mean * lit
        weighted = lit, self.shown, self.shown * about_mean
        self._integrals = [cv2.integral(each, sdepth=cv2.CV_64F) for each in weighted]
        self._step = step
        self._hidden = in_squares(1 - lit, step)
        self._spots = list(_spots(self._hidden))
        self._windows: dict[tuple[int, ...], list[_Windows]] = {}

    def correct(self, scores: NDArray[np.float32], sums: NDArray[np.float32], template: Footprint) -> None:
        """Replace the normalised correlation of the windows that glare is in; it is 0 where too little of one is lit.

        Args:
            scores: The normalised correlation of each window, which is changed.
            sums: The sum of products of `shown` with the template in each window.
            template: The template.
        """
        if template.size not in self._windows:
            self._windows[template.size] = list(self._near(*template.size))
        for places, hidden, lit, means, norms in self._windows[template.size]:
            lost, lost_power = (
                cv2.matchTemplate(hidden, each, cv2.TM_CCORR) for each in (template.sums, template.powers)
            )
            shown = np.maximum(1 - lost_power - lost * lost / lit, np.float32(MIN_SHOWN))
            scores[places] = (sums[places] + means * lost) / (norms * np.sqrt(shown))

    def _near(self, height: int, width: int) -> Iterator[_Windows]:
        """Yield the windows of a size that each spot is in."""
        step = self._step
        high, wide = -(-height // step), -(-width // step)
        rows, columns = (
            (side - 1 - size) // step + 1 for side, size in zip(self._integrals[0].shape, (height, width), strict=True)
        )
        for left, top, right, bottom in self._spots:
            y, x = max(0, top - high + 1), max(0, left - wide + 1)
            end_y, end_x = min(rows, bottom), min(columns, right)
            if end_y <= y or end_x <= x:
                continue
            up, low = (slice(o + y * step, o + (end_y - 1) * step + 1, step) for o in (0, height))
            near, far = (slice(o + x * step, o + (end_x - 1) * step + 1, step) for o in (0, width))
            lit, total, square = (
                each[low, far] - each[up, far] - each[low, near] + each[up, near] for each in self._integrals
            )
            few = lit < MIN_LIT * height * width
            lit = np.maximum(lit, 1.0)
            norms = np.sqrt(np.maximum(square - total * total / lit, FLAT_SD**2 * lit))
            norms[few] = np.inf
            yield _Windows(
                (slice(y, end_y), slice(x, end_x)),
                self._hidden[y : end_y + high - 1, x : end_x + wide - 1],
                *(each.astype(np.float32) for each in (lit, total / lit, norms)),
            )


def in_squares(image: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """Return the means of an image in squares of a side; zeros complete the last ones."""
    if step == 1:
        return image
    rows, columns = (-(-side // step) for side in image.shape)
    padded = np.zeros((rows * step, columns * step), np.float32)
    padded[: image.shape[0], : image.shape[1]] = image
    return np.asarray(cv2.resize(padded, (columns, rows), interpolation=cv2.INTER_AREA), np.float32)


def _spots(hidden: NDArray[np.float32]) -> Iterator[_Spot]:
    """Yield the boxes of the spots in an image that is 0 elsewhere."""
    glare = (hidden > 0).astype(np.uint8)
    count, labels = cv2.connectedComponents(cv2.dilate(glare, SPOTS_APART))
    for number in range(1, count):
        left, top, width, height = cv2.boundingRect(((labels == number) & (glare > 0)).astype(np.uint8))
        yield left, top, left + width, top + height
