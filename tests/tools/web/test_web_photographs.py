"""A box drawn on the camera's picture becomes a target that the detector finds."""

from __future__ import annotations

import json
import tomllib

import cv2
import numpy as np
import pytest
from pydantic import TypeAdapter

from nxtdrive.mission.checking import check_mission
from nxtdrive.mission.files import PICTURES
from nxtdrive.tools.web.messages import read
from nxtdrive.tools.web.photographs import KEPT, NewTarget, Photographs

BOX = (100, 60, 90, 120)
MISSION = """\
# my mission
[mission]
name = "two"   # a comment
targets = [
    "box",  # the red one
]

[target.box]
detector = "color"
color = "red"
"""


@pytest.fixture(scope="module")
def frame() -> np.ndarray:
    """A gray wall with a picture on it."""
    image = np.full((240, 320, 3), 128, np.uint8)
    lena = cv2.imread(str(PICTURES / "lena.png"))
    image[60:180, 100:190] = cv2.resize(lena, (90, 120), interpolation=cv2.INTER_AREA)
    return image


def _target(**changes: object) -> NewTarget:
    values = {"text": "", "name": "lena", "height_mm": 297, "picture": 1, "box": BOX, **changes}
    return NewTarget.model_validate(values)


def _photographs(folder, frame) -> Photographs:
    photographs = Photographs(folder, lambda: frame)
    photographs.take()
    return photographs


def test_a_new_mission_is_made_of_a_box(tmp_path, frame):
    added = _photographs(tmp_path, frame).add(_target())
    assert added["file"] == "lena.png"
    saved = cv2.imread(str(tmp_path / "lena.png"))
    assert np.array_equal(saved, frame[60:180, 100:190])
    (tmp_path / "new.toml").write_text(added["text"], encoding="utf-8")
    assert check_mission(tmp_path / "new.toml").mistakes == []


@pytest.mark.parametrize("name", ["cat", "Kätzchen", "my cat", "a-b_c"])
def test_a_target_is_added_at_the_end_and_comments_stay(tmp_path, frame, name):
    text = _photographs(tmp_path, frame).add(_target(text=MISSION, name=name))["text"]
    values = tomllib.loads(text)
    assert values["mission"]["targets"] == ["box", name]
    assert values["target"][name] == {
        "detector": "picture",
        "pictures": [f"{name.replace(' ', '-')}.png"],
        "height_mm": 297,
    }
    assert all(comment in text for comment in ("# my mission", "# a comment", "# the red one"))


def test_no_picture_is_overwritten(tmp_path, frame):
    photographs = _photographs(tmp_path, frame)
    assert [photographs.add(_target())["file"] for _ in range(3)] == ["lena.png", "lena-2.png", "lena-3.png"]


def test_a_picture_that_a_full_disk_cuts_short_is_removed(tmp_path, frame):
    resource = pytest.importorskip("resource")
    photographs, limits = _photographs(tmp_path, frame), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            photographs.add(_target())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []


def test_no_picture_is_called_as_a_device_of_windows(tmp_path, frame):
    assert _photographs(tmp_path, frame).add(_target(name="Con"))["file"] == "Con-target.png"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"box": (0, 0, 60, 60)}, "single colour"),
        ({"box": (100, 60, 30, 30)}, "30x30 pixels"),
        ({"box": (-1, 0, 50, 50)}, "does not lie"),
        ({"box": (300, 60, 50, 50)}, "does not lie"),
        ({"box": (190, 180, -90, -120)}, "does not lie"),
        ({"box": (0, 0, 0, 0)}, "does not lie"),
        ({"picture": 2}, "no longer kept"),
        ({"text": "[mission"}, "cannot be added"),
        ({"text": "[mission]\ntargets = 3\n"}, "cannot be added"),
        ({"text": "mission = 3\n"}, "cannot be added"),
        ({"text": "[robot]\n"}, "cannot be added"),
        ({"text": MISSION, "name": "box"}, "cannot be added"),
        ({"text": 'target = {}\n[mission]\ntargets = ["a"]\n'}, "cannot be added"),
    ],
)
def test_what_cannot_be_used_is_refused_and_leaves_no_file(tmp_path, frame, changes, says):
    with pytest.raises(ValueError, match=says):
        _photographs(tmp_path, frame).add(_target(**changes))
    assert list(tmp_path.iterdir()) == []


def test_a_box_that_the_detector_does_not_find_again_is_refused(tmp_path):
    faint = np.full((240, 320, 3), 128, np.uint8)
    faint[::2, ::3] += 3  # a fine pattern that is everywhere the same
    with pytest.raises(ValueError, match="does not find"):
        _photographs(tmp_path, faint).add(_target())


@pytest.mark.parametrize("name", ["", "../x", "a/b", "a.b", "-", "x" * 41, 'a"b', "a\nb", " a"])
def test_other_names_are_refused(name):
    with pytest.raises(ValueError, match="name: must be 1 to 40 letters, digits, spaces"):
        read(TypeAdapter(NewTarget), json.dumps(_target().model_dump() | {"name": name}))


def test_pictures_are_kept_for_a_while_and_a_camera_may_have_given_none(tmp_path, frame):
    photographs = _photographs(tmp_path, frame)
    number, png = [photographs.take() for _ in range(KEPT)][-1]
    assert number == KEPT + 1
    assert png.startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="no longer kept"):
        photographs.add(_target(picture=1))
    with pytest.raises(ValueError, match="no picture"):
        Photographs(tmp_path, lambda: None).take()
