"""Read pictures: their size first, then their pixels."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from input_files.plain import MEGABYTE, InputFileError, read_bytes, refuse_empty

MAX_BYTES = 64 * MEGABYTE
MAX_PIXELS = 64_000_000
"""Decoding takes 3 bytes for each, and 10 to 14 where some are transparent."""
MAX_SIDE = 16_000
"""Longest side of a picture: OpenCV transforms no image with one of 32,767, and some are enlarged."""
KEPT_PIXELS = 16_000_000
"""A picture with more is reduced to half its width and height; detectors need far fewer."""
FORMATS = ("PNG", "JPEG", "BMP", "WEBP", "TIFF", "PPM")

log = logging.getLogger(__name__)


def read_picture(path: Path) -> NDArray[np.uint8]:
    """Read a picture as BGR; one of more than 16 million pixels is reduced, and what is transparent becomes white.

    Raises:
        InputFileError: The file cannot be read, is empty, is not a picture of 8 or 16 bits, or has more than 64 million
            pixels or a side of more than 16,000.
    """
    data = read_bytes(path, MAX_BYTES)
    refuse_empty(path, len(data))
    width, height, transparent = _header(path, data)
    pixels = width * height
    if pixels > MAX_PIXELS:
        raise InputFileError(
            f"{path} has {width}x{height} pixels; {MAX_PIXELS / 1e6:.0f} million are the limit. Make it smaller."
        )
    if max(width, height) > MAX_SIDE:
        raise InputFileError(
            f"{path} has {width}x{height} pixels; {MAX_SIDE} are the limit for a side. Make it smaller, or cut it."
        )
    reduced = pixels > KEPT_PIXELS
    flags = cv2.IMREAD_REDUCED_COLOR_2 if reduced else cv2.IMREAD_COLOR
    try:
        image = _on_paper(data, reduced) if transparent else cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except (cv2.error, OSError, SyntaxError, ValueError):  # as OpenCV and Pillow report damage
        image = None
    if image is None or image.ndim != 3:  # a grey one of floating-point numbers stays grey
        raise InputFileError(f"{path} is damaged or incomplete. Copy it again, or save it again as PNG or JPEG.")
    if reduced:
        log.info("%s has %dx%d pixels and is reduced to 1/2 of its width and height.", path, width, height)
    return image.astype(np.uint8, copy=False)


@contextmanager
def _opened(data: bytes) -> Iterator[Image.Image]:
    """Open a picture without Pillow's warnings: of its size, which is judged here, and of damage."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            yield image


def _header(path: Path, data: bytes) -> tuple[int, int, bool]:
    """Return width, height and whether there may be transparent pixels, as the file's header says."""
    try:
        with _opened(data) as image:
            return *image.size, image.has_transparency_data
    except Image.DecompressionBombError as error:
        raise InputFileError(f"{path} has far too many pixels ({error}). Make it smaller.") from None
    except Exception:  # noqa: BLE001 - whatever a damaged header makes of the library
        raise InputFileError(_why_no_picture(path, data)) from None


def _on_paper(data: bytes, reduced: bool) -> NDArray[np.uint8]:
    """Decode a picture with transparent pixels as it comes out of a printer; their colours under it are arbitrary."""
    with _opened(data) as image:
        ImageOps.exif_transpose(image, in_place=True)
        layer = image if image.mode == "RGBA" else image.convert("RGBA")
        if reduced:
            layer = layer.reduce(2)  # before it is copied: it has four bytes for each of up to 64 million pixels
        paper = Image.new("RGB", layer.size, "white")
        paper.paste(layer, mask=layer)
    return np.asarray(paper)[:, :, ::-1].copy()


def _why_no_picture(path: Path, data: bytes) -> str:
    begins = {b"ftyp": "HEIC or AVIF picture or a video", b"GIF8": "GIF picture"}
    # files of the first family begin with a box, which has its length first
    if kind := begins.get(data[4:8]) or begins.get(data[:4]):
        return f"{path} is a {kind}, whatever its name ends in. Save it as JPEG or PNG."
    return f"{path} is not an image OpenCV can read. Use a PNG or JPEG file."
