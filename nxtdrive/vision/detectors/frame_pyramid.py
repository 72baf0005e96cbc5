"""Make the pyramid of a frame that correlation works on: grey levels without glare, and the colours.

Glare is white and hides what is below it. If a frame has little white, that and its rim are left out of correlation
(and replaced by the mean of their surroundings, which its edge is mixed with), and are white in the colours, so that
comparisons leave them out. A frame with much white is overexposed; there the picture is cut at white instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.alignment import Canvas, Poses, canvas_of
from nxtdrive.vision.detectors.fourier import correlated, spectra
from nxtdrive.vision.detectors.lit_windows import FLAT_SD, Footprint, LitWindows
from nxtdrive.vision.detectors.resemblance import CUT, WHITE
from nxtdrive.vision.detectors.scaling import at_most_wide

WORK_WIDTH = 320
"""Proposals are made on a copy of the frame at most this wide."""

MIN_SIDE = 14
"""The coarsest level is at least this wide and high, in pixels."""

STEPS = (2, 1, 1, 1, 1)
"""Places are proposed at every second pixel of the finest level only: the alignment finds the one between them."""

GLARE_SPREAD_PX = 5.0
"""Glare is replaced by the mean of what lies within about this distance, on each level: mostly of the print."""

DAZZLING, USUAL, MIN_DAZZLING = 1.5, 0.995, 190.0
"""Blur and compression darken a small reflection: it is white from this factor of what this share of a frame does not
exceed, and never below this value."""

NEXT_TO, SOFT, NEAR, LARGE_GLARE, LARGE_RIM = (np.ones((side, side), np.uint8) for side in (3, 5, 7, 9, 17))
AROUND_PX, RISE = 21, 60
"""The rim of glare is this much brighter than the mean of its surroundings; it is up to 3 pixels of the finest level
wide, 4 around white that `LARGE_GLARE` fits into."""

OVEREXPOSED = 0.2
"""From this share of white pixels on, the picture is compared as an overexposed frame shows it."""

COLORED = 0.03
"""Up to this share of a frame may have a channel cut by objects of strong colours."""


_Strips: TypeAlias = list[NDArray[np.int32]]
"""Sums in the strips of a height from the left edge to every `step`-th column, from each of the first columns on."""


class Transformed(NamedTuple):
    """A template, prepared for the levels of a shape.

    Attributes:
        spectra: The complex conjugate of its `spectra`.
        footprint: The same as glare hides it.
    """

    spectra: NDArray[np.complex64]
    footprint: Footprint


class Level:
    """One level of the pyramid.

    Args:
        gray: The grey frame.
        scale: Size of the frame divided by the size of this level.
        step: Distance in pixels between the places that are proposed.
        lit: 1 where it is to be compared, 0 in glare, whose gray is that of its surroundings; None without glare.

    Attributes:
        spectra: Fourier transforms (`spectra`) of what is lit.
    """

    def __init__(
        self, gray: cv2.typing.MatLike, scale: float, step: int, lit: cv2.typing.MatLike | None = None
    ) -> None:
        self.gray = gray.astype(np.float32)
        self.lit = None if lit is None else lit.astype(np.float32, copy=False)
        self.scale = scale
        self.step = step
        self._near_glare = None if self.lit is None else LitWindows(self.gray, self.lit, step)
        shown = self.gray if self._near_glare is None else self._near_glare.shown
        self.spectra = spectra(shown, self.gray.shape, step)
        self._integrals = cv2.integral2(gray, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)
        self._strips: dict[int, list[_Strips]] = {}
        self._norms: dict[tuple[int, int], NDArray[np.float32]] = {}

    def score(self, template: Transformed, out: NDArray[np.float32]) -> None:
        """Write the normalised correlation with a template at every step; 0 where it would reach out of the level."""
        correlation = correlated(self.spectra, template.spectra, out.shape[1])
        np.divide(correlation, self.norms(*template.footprint.size), out=out)
        if self._near_glare is not None:
            self._near_glare.correct(out, correlation, template.footprint)

    def norms(self, height: int, width: int) -> NDArray[np.float32]:
        """Return the norm of each window of a size about its mean, at the level's steps; computed once.

        It is infinite where a window would reach out of the level.
        """
        key = (height, width)
        if key not in self._norms:
            total, square = (self._summed(strips, width) for strips in self._strips_of(height))
            area = height * width
            norms = np.full([-(-side // self.step) for side in self.gray.shape], np.inf, np.float32)
            inside = norms[: total.shape[0], : total.shape[1]]
            np.sqrt(np.maximum(square - total * total / np.float32(area), np.float32(FLAT_SD**2 * area)), out=inside)
            self._norms[key] = norms
        return self._norms[key]

    def _strips_of(self, height: int) -> list[_Strips]:
        """Return the sums of grey values and of their squares in the strips of a height."""
        if height not in self._strips:
            step = self.step
            strips = ((each[height::step] - each[:-height:step]).astype(np.int32) for each in self._integrals)
            self._strips[height] = [[np.ascontiguousarray(s[:, right::step]) for right in range(step)] for s in strips]
        return self._strips[height]

    def _summed(self, strips: _Strips, width: int) -> NDArray[np.float32]:
        """Return the sum of each window of a width, at the level's steps."""
        right, columns = width // self.step, (self.gray.shape[1] - width) // self.step + 1
        sums = strips[width % self.step][:, right : right + columns] - strips[0][:, :columns]
        return sums.astype(np.float32)


@dataclass(frozen=True, slots=True)
class Pyramid:
    """A frame, prepared for all matchers.

    Attributes:
        levels: Grey, the finest first, at most `WORK_WIDTH` wide.
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
    work, scale = at_most_wide(image, WORK_WIDTH)
    colors = [(image, 1.0), (work, scale)] if scale > 1.0 else [(image, 1.0)]
    overexposed, glare = _glare(work)
    if glare is not None:
        colors = [(_whitened(each, glare), one) for each, one in colors]
        work = colors[-1][0]
    gray: cv2.typing.MatLike = cv2.cvtColor(work, cv2.COLOR_BGR2GRAY)
    lit: cv2.typing.MatLike | None = None if glare is None else (1 - glare).astype(np.float32)
    levels: list[Level] = []
    for number, step in enumerate(STEPS):
        if number:
            if min(gray.shape) < 2 * MIN_SIDE:
                break
            gray, work = _halved(gray), _u8(_halved(work))
            lit = None if lit is None else _halved(lit)
            colors.append((work, scale * 2**number))
        if lit is not None:
            gray = _filled(gray, lit)
        levels.append(Level(gray, scale * 2**number, step, lit))
    canvas = canvas_of([(level.gray, level.lit, level.scale) for level in levels])
    return Pyramid(levels, canvas, colors, overexposed)


def _glare(image: Image) -> tuple[bool, cv2.typing.MatLike | None]:
    """Return whether a frame is overexposed, and otherwise where it shows glare: white, and its bright rim.

    Glare is white in all channels; where single channels are cut much more often, it is the exposure.
    """
    blue, green, red = cv2.split(image)
    least, most = cv2.min(cv2.min(blue, green), red), cv2.max(cv2.max(blue, green), red)
    share, cut = float((least > WHITE).mean()), float((most > CUT).mean())
    if share > OVEREXPOSED or cut > 2 * share + COLORED:
        return share > OVEREXPOSED, None
    usual = np.searchsorted(np.cumsum(np.bincount(_u8(least).ravel())), USUAL * least.size)
    white = (least > min(WHITE, max(MIN_DAZZLING, DAZZLING * float(usual)))).astype(np.uint8)
    if not white.any():
        return False, None
    lit = (1 - cv2.dilate(white, SOFT)).astype(np.float32)
    around = cv2.blur(least * lit, (AROUND_PX, AROUND_PX)) / np.maximum(cv2.blur(lit, (AROUND_PX, AROUND_PX)), 1e-3)
    near = cv2.bitwise_or(cv2.dilate(white, NEAR), cv2.dilate(cv2.erode(white, LARGE_GLARE), LARGE_RIM))
    rim = cv2.bitwise_and(near, (least > around + RISE).astype(np.uint8))
    return False, cv2.bitwise_or(rim, cv2.dilate(white, NEXT_TO))


def _halved(image: cv2.typing.MatLike) -> cv2.typing.MatLike:
    """Return a copy of half the size."""
    return cv2.resize(image, (image.shape[1] // 2, image.shape[0] // 2), interpolation=cv2.INTER_AREA)


def _whitened(image: Image, glare: cv2.typing.MatLike) -> Image:
    """Return a copy of an image that is white in glare, given at the size of the finest level."""
    white = cv2.resize(glare, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    return np.where(white[:, :, None] > 0, np.uint8(255), image)


def _filled(gray: cv2.typing.MatLike, lit: cv2.typing.MatLike) -> cv2.typing.MatLike:
    """Return a grey image with glare replaced by the mean of its surroundings."""
    around, weight = (cv2.GaussianBlur(each, (0, 0), GLARE_SPREAD_PX) for each in (gray * lit, lit))
    fill = (around + 1e-3 * np.float32(gray.mean())) / (weight + 1e-3)
    return (gray * lit + fill * (1 - lit)).clip(0, 255).astype(np.uint8)


def rectified(frame: Pyramid, pose: Poses, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the colours that the frame shows at a pose, (height, width, 3), 0..255, and which pixels lie inside it."""
    tall = float(np.hypot(*pose[:, 1]))
    fine = [number for number, (_, scale) in enumerate(frame.colors) if tall / scale >= height - 0.5]
    image, scale = frame.colors[fine[-1] if fine else 0]
    to_pixels = np.array([[1 / width, 0, 0.5 / width - 0.5], [0, 1 / height, 0.5 / height - 0.5], [0, 0, 1]])
    matrix = (pose / scale) @ to_pixels
    matrix[:, 2] -= 0.5
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    warped = cv2.warpAffine(image, matrix, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    across, down = np.arange(width), np.arange(height)[:, None]
    x, y = (row[0] * across + row[1] * down + row[2] for row in matrix)
    inside = (x > -1) & (y > -1) & (x < image.shape[1]) & (y < image.shape[0])
    return np.asarray(warped, np.float32), inside


def _u8(array: cv2.typing.MatLike) -> Image:
    """Return the array as uint8, which OpenCV's stubs do not say it is."""
    return array.astype(np.uint8, copy=False)
