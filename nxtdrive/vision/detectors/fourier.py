"""Correlate images at every step of some pixels, by their Fourier transforms."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
from numpy.typing import NDArray


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
