"""Pictures: their size is read before they are decoded."""

import logging
import struct
import zlib

import cv2
import numpy as np
import pytest

from input_files.picture import KEPT_PIXELS, read_picture
from input_files.plain import InputFileError


def _png_of(width, height):
    """The beginning of a PNG; its pixels are not needed to refuse it."""
    header = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header))


@pytest.mark.parametrize("size", [(20_000, 20_000), (9000, 9000), (2**31 - 1, 2**31 - 1), (1, 100_000_000)])
def test_a_picture_with_too_many_pixels_is_refused_by_its_header(tmp_path, size):
    path = tmp_path / "large.png"
    path.write_bytes(_png_of(*size) + bytes(100))
    with pytest.raises(InputFileError, match=r"large\.png (has|is)"):
        read_picture(path)


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_a_large_picture_is_reduced_and_only_the_log_says_so(tmp_path, caplog, suffix):
    path = tmp_path / f"large{suffix}"
    gradient = np.linspace(0, 255, 5000, dtype=np.uint8)
    cv2.imwrite(str(path), np.broadcast_to(gradient, (4000, 5000)))
    with caplog.at_level(logging.INFO, logger="input_files"):
        image = read_picture(path)
    assert {each.levelno for each in caplog.records} == {logging.INFO}
    assert image.shape == (2000, 2500, 3)
    assert image.shape[0] * image.shape[1] < KEPT_PIXELS
    assert "5000x4000 pixels and is reduced to 1/2" in caplog.text


def test_an_ordinary_picture_is_read_as_it_is(tmp_path, caplog):
    path = tmp_path / "picture.png"
    pixels = np.random.default_rng(0).integers(0, 256, (300, 400, 3), np.uint8)
    cv2.imwrite(str(path), pixels)
    assert (read_picture(path) == pixels).all()
    assert caplog.text == ""


@pytest.mark.parametrize(
    "content", [b"", b"\x89PNG", b"GIF89a" + bytes(100), _png_of(100, 100), b"x" * 1000, bytes(99)]
)
def test_anything_that_is_not_a_picture_is_refused(tmp_path, content):
    path = tmp_path / "picture.png"
    path.write_bytes(content)
    with pytest.raises(InputFileError, match=r"not an image OpenCV can read"):
        read_picture(path)
