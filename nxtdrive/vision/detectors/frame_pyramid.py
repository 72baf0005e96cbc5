"""Makes the pyramid of a frame that correlation works on: gray levels without glare, and the colours.

Glare is white and hides what is below it. If a frame has little white, that and its rim are replaced by the mean of
their surroundings in gray, so that they do not affect correlation, and are white in the colours, so that comparisons
leave them out. A frame with much white is overexposed; there the picture is cut at white instead.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TypeAlias

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

GLARE_SPREAD_PX = 5.0
"""Glare is replaced by the mean of what lies within about this distance, on the finest level: mostly of the print."""

DAZZLING, USUAL, LEAST_DAZZLING = 1.5, 0.995, 190.0
"""Blur and compression darken a small reflection: it is white from this factor of what this share of a frame does not
exceed, and never below this value."""

NEXT_TO, SOFT, NEAR, LARGE_GLARE, LARGE_RIM = (np.ones((side, side), np.uint8) for side in (3, 5, 7, 9, 17))
AROUND_PX, RISE = 21, 60
"""The rim of glare is this much brighter than the mean of its surroundings; it is up to half of `NEAR` wide, and half
of `LARGE_RIM` around white of the size `LARGE_GLARE`; in pixels of the finest level."""

OVEREXPOSED = 0.2
"""From this share of white pixels on, the picture is compared as an overexposed frame shows it."""

COLORED = 0.03
"""Up to this share of a frame may have a channel cut by objects of strong colours."""


_Strips: TypeAlias = list[NDArray[np.int32]]
"""Sums in the strips of a height from the left edge to every `step`-th column, from each of the first columns on."""


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
        self._integrals = cv2.integral2(gray, sdepth=cv2.CV_32S, sqdepth=cv2.CV_64F)
        self._strips: dict[int, list[_Strips]] = {}
        self._norms: dict[tuple[int, int], NDArray[np.float32]] = {}

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
        """Return the sums of gray values and of their squares in the strips of a height."""
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
    if glare is not None:
        colors = [(_whitened(each, glare), one) for each, one in colors]
        work = colors[-1][0]
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
    share, cut = float((least > WHITE).mean()), float((most > CUT).mean())
    if share > OVEREXPOSED or cut > 2 * share + COLORED:
        return share > OVEREXPOSED, None
    usual = np.searchsorted(np.cumsum(np.bincount(_u8(least).ravel())), USUAL * least.size)
    white = (least > min(WHITE, max(LEAST_DAZZLING, DAZZLING * float(usual)))).astype(np.uint8)
    if not white.any():
        return False, None
    lit = (1 - cv2.dilate(white, SOFT)).astype(np.float32)
    around = cv2.blur(least * lit, (AROUND_PX, AROUND_PX)) / np.maximum(cv2.blur(lit, (AROUND_PX, AROUND_PX)), 1e-3)
    near = cv2.bitwise_or(cv2.dilate(white, NEAR), cv2.dilate(cv2.erode(white, LARGE_GLARE), LARGE_RIM))
    rim = cv2.bitwise_and(near, (least > around + RISE).astype(np.uint8))
    return False, cv2.bitwise_or(rim, cv2.dilate(white, NEXT_TO))


def _whitened(image: Image, glare: cv2.typing.MatLike) -> Image:
    """Return a copy of an image that is white in glare, given at the size of the finest level."""
    white = cv2.resize(glare, image.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    return np.where(white[:, :, None] > 0, np.uint8(255), image)


def _filled(image: Image, glare: cv2.typing.MatLike) -> Image:
    """Return the image with glare replaced by the mean of its surroundings."""
    lit = np.asarray(1 - glare, np.float32)
    around = cv2.GaussianBlur(image * lit[:, :, None], (0, 0), GLARE_SPREAD_PX)
    weight = cv2.GaussianBlur(lit, (0, 0), GLARE_SPREAD_PX)
    mean = np.array(cv2.mean(image)[:3], np.float32)
    fill = (around + 1e-3 * mean) / (weight[:, :, None] + 1e-3)
    return np.where(glare[:, :, None] > 0, fill, image).clip(0, 255).astype(np.uint8)


def spectra(gray: NDArray[np.float32], shape: tuple[int, int], step: int) -> NDArray[np.complex64]:
    """Return the Fourier transforms (step * step, rows, columns / 2 + 1) of an image.

    One for each place in a square of `step` pixels, of the pixels that lie there in their square: the correlation at
    every such step is the sum of theirs.

    Args:
        gray: The image.
        shape: Height and width to which zeros pad it.
        step: Distance in pixels.
    """
    rows, columns = (-(-side // step) for side in shape)
    padded = np.zeros((rows * step, columns * step), np.float32)
    padded[: gray.shape[0], : gray.shape[1]] = gray
    squares = itertools.product(range(step), repeat=2)
    return np.stack([_unpacked(cv2.dft(padded[down::step, right::step])) for down, right in squares])


def correlated(seen: NDArray[np.complex64], sought: NDArray[np.complex64], columns: int) -> NDArray[np.float32]:
    """Return the correlation of two images at every step, which are `columns` wide.

    Args:
        seen: The `spectra` of one.
        sought: The complex conjugates of the `spectra` of the other.
        columns: Width of the correlation.
    """
    product = seen[0] * sought[0]
    for one, other in zip(seen[1:], sought[1:], strict=True):
        product += one * other
    return np.asarray(cv2.idft(_packed(product, columns), flags=cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT), np.float32)


def _packed(spectrum: NDArray[np.complex64], columns: int) -> NDArray[np.float32]:
    """Return half a spectrum as OpenCV packs it: columns that are symmetric lack their second half.

    Source: OpenCV's reference of `cv::dft`, the CCS format.
    """
    rows = len(spectrum)
    packed = np.empty((rows, columns), np.float32)
    packed[:, 1:] = spectrum.view(np.float32)[:, 2 : columns + 1]
    for column in _symmetric(columns):
        values = np.ascontiguousarray(spectrum[: rows // 2 + 1, column]).view(np.float32)
        packed[0, column] = values[0]
        packed[1:, column] = values[2 : rows + 1]
    return packed


def _unpacked(packed: cv2.typing.MatLike) -> NDArray[np.complex64]:
    """Undo `_packed`."""
    rows, columns = packed.shape
    spectrum = np.empty((rows, columns // 2 + 1), np.complex64)
    spectrum.view(np.float32)[:, 2 : columns + 1] = packed[:, 1:]
    for column in _symmetric(columns):
        values = np.zeros(2 * (rows // 2 + 1), np.float32)
        values[0] = packed[0, column]
        values[2 : rows + 1] = packed[1:, column]
        half = values.view(np.complex64)
        spectrum[: len(half), column] = half
        spectrum[len(half) :, column] = half[1 : (rows + 1) // 2][::-1].conj()
    return spectrum


def _symmetric(columns: int) -> tuple[int, ...]:
    """Return which columns of half a spectrum are symmetric: those of the lowest and of the highest frequency."""
    return (0, -1) if columns % 2 == 0 else (0,)


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
