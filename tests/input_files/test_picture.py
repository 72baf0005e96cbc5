"""Pictures: their size is read before they are decoded."""

import logging
import re
import struct
import subprocess
import sys
import zlib

import cv2
import numpy as np
import pytest

from input_files.picture import KEPT_PIXELS, MAX_SIDE, read_picture
from input_files.plain import InputFileError


def _png_of(width, height):
    """The beginning of a PNG; its pixels are not needed to refuse it."""
    header = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    begin = b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header))
    return begin + struct.pack(">I", 100) + b"IDAT"


@pytest.mark.parametrize(
    ("size", "says"),
    [
        ((20_000, 20_000), "large.png has far too many pixels"),
        ((2**31 - 1, 2**31 - 1), "large.png has far too many pixels"),
        ((9000, 9000), "large.png has 9000x9000 pixels; 64 million are the limit. Make it smaller."),
        ((1, 100_000_000), "large.png has 1x100000000 pixels; 64 million are the limit. Make it smaller."),
    ],
)
def test_a_picture_with_too_many_pixels_is_refused_by_its_header(tmp_path, size, says):
    path = tmp_path / "large.png"
    path.write_bytes(_png_of(*size) + bytes(100))
    with pytest.raises(InputFileError, match=re.escape(says)):
        read_picture(path)


@pytest.mark.parametrize("size", [(MAX_SIDE + 1, 40), (40, MAX_SIDE + 1)])
def test_a_picture_with_a_side_that_is_too_long_for_opencv_is_refused(tmp_path, size):
    path = tmp_path / "long.png"
    cv2.imwrite(str(path), np.zeros((size[1], size[0], 3), np.uint8))
    with pytest.raises(InputFileError, match=rf"long\.png has {size[0]}x{size[1]} pixels; {MAX_SIDE} are the limit"):
        read_picture(path)
    cv2.imwrite(str(path), np.zeros((min(size[1], MAX_SIDE), min(size[0], MAX_SIDE), 3), np.uint8))
    assert max(read_picture(path).shape) == MAX_SIDE


@pytest.mark.parametrize("kind", ["Pf", "PF"])
def test_a_picture_of_floating_point_numbers_is_refused(tmp_path, kind):
    path = tmp_path / "picture.ppm"
    path.write_bytes(f"{kind}\n50 50\n-1.0\n".encode() + bytes(4 * 50 * 50 * (3 if kind == "PF" else 1)))
    with pytest.raises(InputFileError, match="PNG or JPEG"):
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


@pytest.mark.parametrize("content", [b"\x89PNG", b"x" * 1000, bytes(99)])
def test_anything_that_is_not_a_picture_is_refused(tmp_path, content):
    path = tmp_path / "picture.png"
    path.write_bytes(content)
    with pytest.raises(InputFileError, match=r"not an image OpenCV can read"):
        read_picture(path)


@pytest.mark.parametrize("brand", [b"heic", b"mif1", b"avif"])
def test_a_phones_heic_is_named_whatever_its_suffix(tmp_path, brand):
    path = tmp_path / "cat.png"
    path.write_bytes(b"\x00\x00\x00\x24ftyp" + brand + bytes(1000))
    with pytest.raises(InputFileError, match=r"cat\.png is a HEIC or AVIF picture.*JPEG"):
        read_picture(path)


def test_a_gif_is_named_whatever_its_suffix(tmp_path):
    path = tmp_path / "cat.png"
    path.write_bytes(b"GIF89a" + bytes(100))
    with pytest.raises(InputFileError, match=r"cat\.png is a GIF picture, whatever its name ends in. Save it as JPEG"):
        read_picture(path)


def test_an_empty_file_is_reported_as_empty(tmp_path):
    path = tmp_path / "cat.jpg"
    path.touch()
    with pytest.raises(InputFileError, match=r"cat\.jpg is empty"):
        read_picture(path)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
@pytest.mark.parametrize("channels", [3, 4])
def test_a_picture_that_ends_too_early_is_reported_as_damaged(tmp_path, suffix, channels):
    path = tmp_path / f"cat{suffix}"
    noise = np.random.default_rng(0).integers(0, 256, (300, 400, channels), np.uint8)
    whole = cv2.imencode(suffix, noise)[1].tobytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputFileError, match=r"is damaged or incomplete"):
        read_picture(path)


@pytest.mark.parametrize("side", [40, 4100])
def test_what_is_transparent_is_white_as_on_paper(tmp_path, side):
    path = tmp_path / "logo.png"
    logo = np.zeros((side, side, 4), np.uint8)  # black, and transparent
    logo[:, side // 2 :] = (200, 0, 0, 255)
    cv2.imwrite(str(path), logo)
    image = read_picture(path)
    assert image.dtype == np.uint8
    assert (image[:, : image.shape[1] // 2] == 255).all()
    assert (image[:, image.shape[1] // 2 :] == (200, 0, 0)).all()


READ = """
import resource, sys
from pathlib import Path
from input_files.picture import read_picture

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

before = peak()
read_picture(Path(sys.argv[1]))
print(peak() - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="measures memory in its unit")
def test_a_large_transparent_picture_is_not_copied_before_it_is_reduced(tmp_path):
    path = tmp_path / "large.png"
    cv2.imwrite(str(path), np.zeros((4000, 6000, 4), np.uint8))
    ran = subprocess.run([sys.executable, "-c", READ, path], capture_output=True, text=True, check=True)
    assert int(ran.stdout) < 13 * 4000 * 6000
