"""Makes the pyramid of a frame that correlation works on: gray levels without glare, and the colours.

Glare is white and hides what it lies on. Where a frame has little white, that is replaced by the mean of its
surroundings, so that it tells correlation nothing, and marked, so that comparisons leave it out. A frame with much
white is overexposed; there the picture is cut at white instead.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.alignment import Canvas, Poses, canvas_of
from nxtdrive.vision.detectors.resemblance import CUT, WHITE

WORK_WIDTH = 320
"""Proposals are made on a copy of the frame at most this wide."""

LEAST_SIDE = 14
"""The coarsest level is at least this wide and high, in pixels."""

STEPS = (2, 1, 1, 1, 1)
"""Places are proposed at every second pixel of the finest level only: the alignment finds the one between them."""

FLAT_SD = 1.0
"""Lower bound of a window's contrast, gray levels: only rendered frames have flatter windows."""

GLARE_SPREAD_PX = 12.0
"""Glare is replaced by the mean of what lies within about this distance, on the finest level."""

NEXT_TO, LARGE_GLARE, RIM = (np.ones((side, side), np.uint8) for side in (3, 9, 17))
BRIGHT = 150
"""Around white of the size `LARGE_GLARE`, in pixels of the finest level, glare goes on where all channels are above
this value."""

OVEREXPOSED = 0.2
"""From this share of white pixels on, the picture is compared as an overexposed frame shows it."""

COLORED = 0.03
"""So large a share of a frame may have a channel cut by things of strong colours."""


class Level:
    """One level of the pyramid.

    Args:
        gray: The gray frame.
        scale: Size of the frame divided by the size of this level.
        step: Distance in pixels between the places that are proposed.

    Attributes:
        spectra: The level's Fourier transforms (`spectra`).
    """

    def __init__(self, gray: cv2.typing.MatLike, scale: float, step: int) -> None:
        self.gray = gray.astype(np.float32)
        self.scale = scale
        self.step = step
        self.spectra = spectra(self.gray, self.gray.shape, step)
        self._integrals = cv2.integral2(gray, sdepth=cv2.CV_64F, sqdepth=cv2.CV_64F)
        self._norms: dict[tuple[int, int], NDArray[np.float32]] = {}

    def norms(self, height: int, width: int) -> NDArray[np.float32]:
        """Return the norm of each window of a size about its mean, at the level's steps; computed once."""
        key = (height, width)
        if key not in self._norms:
            total, square = (self._summed(each, height, width) for each in self._integrals)
            area = height * width
            self._norms[key] = np.sqrt(np.maximum(square - total * total / area, FLAT_SD**2 * area), dtype=np.float32)
        return self._norms[key]

    def _summed(self, integral: cv2.typing.MatLike, height: int, width: int) -> NDArray[np.float64]:
        """Return the sum of each window of a size, at the level's steps."""
        rows = integral[height :: self.step] - integral[: -height : self.step]
        return np.asarray(rows[:, width :: self.step] - rows[:, : -width : self.step], np.float64)


@dataclass(frozen=True, slots=True)
class Pyramid:
    """What all matchers need of a frame.

    Attributes:
        levels: Gray, the finest first, at most `WORK_WIDTH` wide.
        canvas: The same levels for the alignment.
        colors: The frame in colour and its smaller copies, with their scales, the finest first.
        overexposed: Whether much of the frame is white.
    """

    levels: list[Level]
    canvas: Canvas
    colors: list[tuple[Image, float]]
    overexposed: bool


def pyramid(image: Image) -> Pyramid:
    """Return the levels of a BGR frame."""
    scale = max(1.0, image.shape[1] / WORK_WIDTH)
    colors = [(image, 1.0)]
    work = image
    if scale > 1:
        size = (round(image.shape[1] / scale), max(1, round(image.shape[0] / scale)))
        work = _u8(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
        colors.append((work, scale))
    overexposed, glare = _glare(work)
    gray = cv2.cvtColor(work if glare is None else _filled(work, glare), cv2.COLOR_BGR2GRAY)
    lit: list[NDArray[np.float32] | None] = [None if glare is None else (1 - glare).astype(np.float32)]
    levels = [Level(gray, scale, STEPS[0])]
    while len(levels) < len(STEPS) and min(gray.shape) >= 2 * LEAST_SIDE:
        size = gray.shape[1] // 2, gray.shape[0] // 2
        gray = cv2.resize(gray, size, interpolation=cv2.INTER_AREA)
        last = lit[-1]
        smaller = None if last is None else cv2.resize(last, size, interpolation=cv2.INTER_AREA)
        lit.append(None if smaller is None else smaller.astype(np.float32))
        work = _u8(cv2.resize(work, size, interpolation=cv2.INTER_AREA))
        colors.append((work, scale * 2 ** len(levels)))
        levels.append(Level(gray, colors[-1][1], STEPS[len(levels)]))
    canvas = canvas_of([(level.gray, each, level.scale) for level, each in zip(levels, lit, strict=True)])
    return Pyramid(levels, canvas, colors, overexposed)


def _glare(image: Image) -> tuple[bool, cv2.typing.MatLike | None]:
    """Return whether a frame is overexposed, and otherwise where it shows glare: white, and its bright rim.

    Glare is white in all channels; where single channels are cut much more often, it is the exposure.
    """
    blue, green, red = cv2.split(image)
    least, most = cv2.min(cv2.min(blue, green), red), cv2.max(cv2.max(blue, green), red)
    white = (least > WHITE).astype(np.uint8)
    share, cut = float(white.mean()), float((most > CUT).mean())
    if share == 0 or share > OVEREXPOSED or cut > 2 * share + COLORED:
        return share > OVEREXPOSED, None
    bright = (least > BRIGHT).astype(np.uint8)
    rim = cv2.bitwise_and(cv2.dilate(cv2.erode(white, LARGE_GLARE), RIM), bright)
    return False, cv2.bitwise_or(rim, cv2.dilate(white, NEXT_TO))


def _filled(image: Image, glare: cv2.typing.MatLike) -> Image:
    """Return the image with glare replaced by the mean of what surrounds it."""
    lit = np.asarray(1 - glare, np.float32)
    around = cv2.GaussianBlur(image * lit[:, :, None], (0, 0), GLARE_SPREAD_PX)
    weight = cv2.GaussianBlur(lit, (0, 0), GLARE_SPREAD_PX)
    mean = np.array(cv2.mean(image)[:3], np.float32)
    fill = (around + 1e-3 * mean) / (weight[:, :, None] + 1e-3)
    return np.where(glare[:, :, None] > 0, fill, image).clip(0, 255).astype(np.uint8)


def spectra(gray: NDArray[np.float32], shape: tuple[int, int], step: int) -> list[NDArray[np.float32]]:
    """Return the Fourier transforms of an image, as `cv2.dft` packs them.

    One for each place in a square of `step` pixels, of the pixels that lie there in their square: the correlation at
    every such step is the sum of theirs.

    Args:
        gray: The image.
        shape: Height and width to which zeros pad it.
        step: Distance in pixels.
    """
    size = [-(-side // step) * step for side in shape]
    padded = np.zeros(size, np.float32)
    padded[: gray.shape[0], : gray.shape[1]] = gray
    squares = itertools.product(range(step), repeat=2)
    return [np.asarray(cv2.dft(padded[down::step, right::step]), np.float32) for down, right in squares]


def correlated(seen: Sequence[NDArray[np.float32]], sought: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return the correlation of two images at every step, from their `spectra` of the same shape."""
    product = np.sum([cv2.mulSpectrums(a, b, 0, conjB=True) for a, b in zip(seen, sought, strict=True)], axis=0)
    return np.asarray(cv2.idft(product, flags=cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT), np.float32)


def straightened(frame: Pyramid, pose: Poses, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the colours that the frame shows at a pose, at a size, and which of them lie inside the frame."""
    tall = float(np.hypot(*pose[:, 1]))
    fine = [number for number, (_, scale) in enumerate(frame.colors) if tall / scale >= height - 0.5]
    image, scale = frame.colors[fine[-1] if fine else 0]
    to_pixels = np.array([[1 / width, 0, 0.5 / width - 0.5], [0, 1 / height, 0.5 / height - 0.5], [0, 0, 1]])
    matrix = (pose / scale) @ to_pixels
    matrix[:, 2] -= 0.5
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    straight = cv2.warpAffine(image, matrix, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    across, down = np.arange(width), np.arange(height)[:, None]
    x, y = (row[0] * across + row[1] * down + row[2] for row in matrix)
    inside = (x > -1) & (y > -1) & (x < image.shape[1]) & (y < image.shape[0])
    return np.asarray(straight, np.float32), inside


def _u8(array: cv2.typing.MatLike) -> Image:
    """Return the array as uint8, which OpenCV's stubs do not say it is."""
    return array.astype(np.uint8, copy=False)
