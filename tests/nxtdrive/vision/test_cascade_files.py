"""Cascades of the user are tried in another process, since damaged ones crash OpenCV."""

import shutil
from pathlib import Path

import cv2
import pytest

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detectors import make_detector

CASCADE = Path(cv2.__file__).parent / "data" / "haarcascade_frontalface_alt2.xml"

BAD = {
    "deep": b'<?xml version="1.0"?>\n<opencv_storage>\n' + b"<a>\n" * 300_000,
    "NUL": bytes(1000),
    "no cascade": b'<?xml version="1.0"?>\n<opencv_storage><a>1</a></opencv_storage>\n',
    "cut short": CASCADE.read_bytes()[:100_000],
    "large": b"<a>" + b" " * 21_000_000,
}


@pytest.mark.parametrize("content", BAD.values(), ids=BAD.keys())
def test_a_cascade_that_crashes_or_stops_opencv_is_refused(tmp_path, content):
    (tmp_path / "bad.xml").write_bytes(content)
    with pytest.raises(ConfigError, match=r"bad\.xml is not a cascade"):
        make_detector({"detector": "haar", "cascade": "bad.xml"}, tmp_path)


def test_a_copy_of_a_cascade_works(tmp_path, astronaut):
    shutil.copy(CASCADE, tmp_path / "mine.xml")
    theirs, mine = (
        make_detector({"detector": "haar", "cascade": name}, tmp_path) for name in (CASCADE.stem, "mine.xml")
    )
    found = mine.detector.detect(astronaut)
    assert found
    assert found == theirs.detector.detect(astronaut)


def test_where_the_system_refuses_a_limit_of_memory_a_cascade_is_tried_without(tmp_path, monkeypatch):
    """As macOS does on Apple's processors."""
    (tmp_path / "sitecustomize.py").write_text(
        "import resource\n"
        "def setrlimit(what, limits):\n"
        "    if what == resource.RLIMIT_AS:\n"
        "        raise ValueError('current limit exceeds maximum limit')\n"
        "resource.setrlimit = setrlimit\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    shutil.copy(CASCADE, tmp_path / "mine.xml")
    make_detector({"detector": "haar", "cascade": "mine.xml"}, tmp_path)
