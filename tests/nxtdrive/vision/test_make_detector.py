"""Detectors made from a specification, and mistakes in it."""

import math

import cv2
import pytest

from behaviors.detector_names import BUILT_IN_DETECTORS
from firmware_protocol.errors import ConfigError
from nxtdrive.tools.dev.onnx_models import red_model
from nxtdrive.vision.detectors import make_detector


@pytest.mark.parametrize(
    "spec",
    [
        {"detector": "picture", "pictures": ["face.png"]},
        {"detector": "picture", "pictures": "face.png"},
        {"detector": "haar"},
        {"detector": "haar", "cascade": "haarcascade_profileface"},
        {"detector": "marker", "id": 3},
        {"detector": "marker", "id": 3, "family": "apriltag_36h11"},
        {"detector": "qr", "text": "7"},
        {"detector": "color", "color": "magenta"},
        {"detector": "onnx", "model": "red.onnx", "label": "box"},
    ],
)
def test_each_kind_is_made_and_finds_nothing_in_the_dark(spec, tmp_path, astronaut):
    cv2.imwrite(str(tmp_path / "face.png"), astronaut)
    (tmp_path / "red.onnx").write_bytes(red_model())
    made = make_detector(spec, tmp_path)
    assert made.detector.detect(astronaut * 0) == []
    assert made.height_mm == 297


def test_every_kind_is_tried_above():
    assert set(BUILT_IN_DETECTORS) == {"picture", "haar", "marker", "qr", "color", "onnx"}


def test_the_height_is_the_targets():
    assert make_detector({"detector": "marker", "id": 3, "height_mm": 158}).height_mm == 158.0


def test_a_cascade_beside_the_mission_file_is_found(tmp_path):
    (tmp_path / "bear.xml").write_text("<a/>")
    with pytest.raises(ConfigError, match=r"bear\.xml is not a cascade"):
        make_detector({"detector": "haar", "cascade": "bear.xml"}, tmp_path)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ({}, "no detector None. Use one of: picture, haar, marker, qr, color, onnx"),
        ({"detector": "magic"}, "no detector 'magic'"),
        ({"detector": ["picture"]}, "no detector"),
        ({"detector": "marker"}, "marker detector needs id"),
        ({"detector": "marker", "id": "3"}, "id of the marker detector must be a whole number, not '3'"),
        ({"detector": "marker", "id": True}, "must be a whole number"),
        ({"detector": "marker", "id": 3, "size": 5}, "no option size"),
        ({"detector": "qr"}, "qr detector needs text"),
        ({"detector": "qr", "text": 7}, "must be a text, not 7"),
        ({"detector": "qr", "text": ""}, "needs a text of 1 to 500 characters, not of 0"),
        ({"detector": "qr", "text": "7" * 501}, "not of 501"),
        ({"detector": "color", "color": 3}, "must be a text"),
        ({"detector": "color", "color": "red", "hue_deg": math.nan}, "hue_deg = nan is not valid"),
        ({"detector": "color", "color": "red", "reach_deg": -3}, "reach_deg = -3 is not valid"),
        ({"detector": "color", "color": "red", "min_saturation_percent": 200}, "lies between 0 and 100"),
        ({"detector": "color", "color": "red", "min_value_percent": -5}, "min_value_percent = -5 is not valid"),
        (
            {"detector": "color", "color": "red", "height_mm": "tall"},
            "height_mm of the color detector must be a number",
        ),
        ({"detector": "color", "color": "red", "height_mm": 0}, "height_mm = 0 is not a valid height"),
        ({"detector": "onnx", "label": "cup"}, "onnx detector needs model"),
        ({"detector": "onnx", "model": "a.onnx"}, "onnx detector needs label"),
        ({"detector": "onnx", "model": "a.onnx", "label": "cup"}, r"a\.onnx: cannot be read"),
        (
            {"detector": "onnx", "model": "a.onnx", "label": "cup", "layout": 3},
            "layout of the onnx detector must be a text",
        ),
        ({"detector": "picture"}, "needs pictures, a list of files"),
        ({"detector": "picture", "pictures": []}, "needs pictures, a list of files"),
        ({"detector": "picture", "pictures": [3]}, "needs pictures, a list of files"),
    ],
)
def test_a_mistake_has_one_clear_sentence(spec, message):
    with pytest.raises(ConfigError, match=message):
        make_detector(spec)


def test_a_missing_picture_is_named_with_its_path(tmp_path):
    with pytest.raises(ConfigError, match=f"{tmp_path}/lena.png: cannot be read"):
        make_detector({"detector": "picture", "pictures": ["lena.png"]}, tmp_path)


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG\r\n\x1a\nbroken"])
def test_a_picture_that_is_none_is_named_with_its_path(tmp_path, content):
    (tmp_path / "lena.png").write_bytes(content)
    with pytest.raises(ConfigError, match=r"lena\.png is (not an image|empty)"):
        make_detector({"detector": "picture", "pictures": ["lena.png"]}, tmp_path)
