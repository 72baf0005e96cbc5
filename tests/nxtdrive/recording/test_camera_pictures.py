"""The camera's pictures of a run: which are kept, their index, and the effect of a damaged index."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from behaviors.ports import Sighting
from firmware_protocol.errors import ConfigError
from nxtdrive.recording.camera_folder import CameraFolder
from nxtdrive.recording.camera_index import looked, read_frames
from nxtdrive.recording.video import write_webm
from nxtdrive.vision.detection import Detection

BOX = (10, 10, 20, 20)
QUAD = ((10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 30.0))
SEEN = looked("lena", Sighting("lena", -3.14159, 1500.0, 0.9, 0.0, BOX), [Detection(BOX, 0.9, QUAD)])
NOTHING = looked("lena", None, [])
HEADER = '{"version":1,"width":64,"height":48,"fps":5}'
VAST = '{"version":1,"width":20000,"height":20000,"fps":5}'


def _image(value=0):
    return np.full((48, 64, 3), value, np.uint8)


def _kept(folder, frames):
    """Keep frames of time, value and look; returns what is read back."""
    camera = CameraFolder(folder / "camera")
    for time_s, value, look in frames:
        camera.add(_image(value), time_s, look)
    camera.close()
    return read_frames(folder)


def _index(folder, *lines):
    (folder / "camera").mkdir()
    (folder / "camera" / "index.jsonl").write_text("\n".join(lines), encoding="utf-8")
    return read_frames(folder)


def test_what_was_kept_is_read_back(tmp_path):
    kept = _kept(tmp_path, [(0.1, 50, None), (0.3, 100, SEEN)])
    assert (kept.header.width, kept.header.height, kept.header.fps) == (64, 48, 5)
    assert [(each.t, each.file) for each in kept.frames] == [(0.1, "000001.jpg"), (0.3, "000002.jpg")]
    (look,) = kept.frames[1].looks
    assert (look.target, look.sighting.bearing_deg, look.sighting.box) == ("lena", -3.142, BOX)
    assert look.found[0].quad == QUAD
    assert cv2.imread(str(tmp_path / "camera" / "000002.jpg")).mean() == pytest.approx(100, abs=1)


def test_the_pictures_are_plain_and_boxes_are_drawn_when_they_are_shown(tmp_path):
    kept = _kept(tmp_path, [(0.1, 100, SEEN)])
    plain = cv2.imread(str(tmp_path / "camera" / "000001.jpg"))
    assert plain.std() < 1
    drawn = kept.drawn(kept.frames[0])
    assert tuple(drawn[20, 10]) == (60, 220, 60), "the box of a sighting is green"


@pytest.mark.parametrize(
    ("frames", "kept"),
    [
        ([(0.0, 1, None), (0.1, 2, None)], [(0.0, 0)]),
        ([(0.0, 1, None), (0.1, 2, NOTHING)], [(0.1, 1)]),
        ([(0.0, 1, NOTHING), (0.1, 2, NOTHING)], [(0.0, 1)]),
        ([(0.0, 1, None), (0.0, 1, NOTHING), (0.0, 1, SEEN)], [(0.0, 2)]),
        ([(0.0, 1, SEEN), (0.0, 1, None)], [(0.0, 1)]),
        ([(0.0, 1, None), (60.0, 2, None)], [(0.0, 0), (60.0, 0)]),
        ([(1.0, 1, None), (0.1, 2, None)], [(1.0, 0)]),
    ],
    ids=["first", "looked", "first looked", "several targets", "frame after its look", "stall", "back in time"],
)
def test_one_picture_is_kept_in_a_fifth_of_a_second_preferably_one_that_was_looked_at(tmp_path, frames, kept):
    assert [(each.t, len(each.looks)) for each in _kept(tmp_path, frames).frames] == kept


def test_a_run_without_frames_has_no_folder_of_pictures(tmp_path):
    assert _kept(tmp_path, []) is None
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "line",
    [
        '{"t":1,"file":"../../secret.jpg"}',
        '{"t":1,"file":"/etc/passwd"}',
        '{"t":1,"file":"000001.jpg\\n"}',
        '{"t":-1,"file":"000001.jpg"}',
        '{"t":NaN,"file":"000001.jpg"}',
        '{"t":1e300,"file":"000001.jpg"}',
        '{"t":1,"file":"000001.jpg","looks":[{"target":"x","found":[{"box":[0,0,1e9,1],"score":1}]}]}',
        '{"t":1,"fi',
        "[" * 100_000,
        "\x00",
    ],
    ids=range(10),
)
def test_a_line_that_is_damaged_is_left_out(tmp_path, line):
    kept = _index(tmp_path, HEADER, line, '{"t":2,"file":"000002.jpg"}')
    assert [each.t for each in kept.frames] == [2]


@pytest.mark.parametrize("header", ["", "{}", HEADER.replace("1", "2", 1), HEADER.replace("64", "0"), VAST])
def test_an_index_without_a_header_that_is_known_counts_as_none(tmp_path, header):
    assert _index(tmp_path, header, '{"t":2,"file":"000002.jpg"}') is None


def test_the_picture_of_a_moment_is_the_latest_before_it(tmp_path):
    kept = _kept(tmp_path, [(1.0, 1, None), (2.0, 2, None)])
    assert [each and each.t for each in map(kept.at, (0.5, 1.0, 1.9, 99.0))] == [None, 1.0, 1.0, 2.0]


def test_pictures_that_cannot_be_read_are_left_out_of_the_video(tmp_path):
    kept = _kept(tmp_path, [(0.0, 50, None), (0.2, 100, None), (0.4, 150, None)])
    (tmp_path / "camera" / "000002.jpg").write_bytes(b"no picture")
    (tmp_path / "camera" / "000003.jpg").unlink()
    write_webm(kept, [], tmp_path / "camera.webm")
    film = cv2.VideoCapture(str(tmp_path / "camera.webm"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 1
    (tmp_path / "camera" / "000001.jpg").unlink()
    with pytest.raises(ConfigError, match="contains no picture"):
        write_webm(kept, [], tmp_path / "none.webm")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["camera", "camera.webm"]


def test_a_video_that_is_interrupted_leaves_nothing_and_takes_nothing_away(tmp_path):
    kept = _kept(tmp_path, [(0.0, 50, None), (0.2, 100, None)])
    (tmp_path / "camera.webm").write_bytes(b"an earlier one")

    def interrupted(pictures):
        yield pictures[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_webm(kept, [], tmp_path / "camera.webm", interrupted)
    assert (tmp_path / "camera.webm").read_bytes() == b"an earlier one"
    assert len(list(tmp_path.iterdir())) == 2


def test_the_video_is_webm(tmp_path):
    write_webm(_kept(tmp_path, [(0.0, 50, SEEN)]), [], tmp_path / "camera.webm")
    head = (tmp_path / "camera.webm").read_bytes()[:64]
    assert head.startswith(b"\x1aE\xdf\xa3")
    assert b"webm" in head
    assert b"matroska" not in head


def test_the_index_names_its_version_and_size_first(tmp_path):
    _kept(tmp_path, [(0.0, 50, SEEN)])
    first, second = (tmp_path / "camera" / "index.jsonl").read_text(encoding="utf-8").splitlines()
    assert json.loads(first) == {"version": 1, "width": 64, "height": 48, "fps": 5.0}
    assert list(json.loads(second)) == ["t", "file", "looks"]
