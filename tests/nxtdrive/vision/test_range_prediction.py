"""Predictions for a photograph before its print is looked for."""

import cv2
import numpy as np
import pytest

from nxtdrive.mission.checking import check_mission
from nxtdrive.mission.files import PICTURES
from nxtdrive.vision.detectors.range_prediction import USUAL_HEIGHT_PX, predict_range


def words():
    """A sheet of nothing but small words."""
    sheet = np.full((594, 420, 3), 235, np.uint8)
    for row in range(14):
        cv2.putText(sheet, f"line {row} of small words", (20, 50 + 40 * row), 0, 0.9, (30, 30, 30), 2, cv2.LINE_AA)
    return sheet


def pale(picture):
    """The picture with hardly any contrast."""
    return (200 + 0.08 * picture.astype(np.float32)).astype(np.uint8)


def test_a_portrait_is_found_from_the_usual_distance(astronaut):
    found = predict_range(astronaut)
    assert found.height_px <= USUAL_HEIGHT_PX
    assert not found.hard
    assert found.limitations == ()


def test_small_words_are_hard_to_find_because_their_details_are_small():
    found = predict_range(words())
    assert found.hard
    assert any("details are small" in each.cause for each in found.limitations)


def test_a_pale_picture_is_hard_to_find_because_of_its_contrast(astronaut):
    found = predict_range(pale(astronaut))
    assert found.hard
    assert any("little contrast" in each.cause for each in found.limitations)


def test_the_same_picture_has_the_same_prospect(astronaut):
    assert predict_range(astronaut) == predict_range(astronaut)


def mission(folder, height_mm=297, **pictures):
    """Write a mission with a target for each picture."""
    lines = ["[mission]", 'name = "m"', f"targets = {list(pictures)}"]
    for name, picture in pictures.items():
        cv2.imwrite(str(folder / f"{name}.png"), picture)
        lines += [f"[target.{name}]", 'detector = "picture"', f'pictures = ["{name}.png"]', f"height_mm = {height_mm}"]
    file = folder / "mission.toml"
    file.write_text("\n".join(lines).replace("'", '"'), encoding="utf-8")
    return file


@pytest.mark.slow
def test_mission_check_says_which_photograph_is_hard_to_find_and_why(tmp_path, astronaut):
    found = check_mission(mission(tmp_path, easy=astronaut, words=words()))
    assert found.mistakes == []
    (warning,) = found.warnings
    assert warning.startswith("target.words: the picture will be hard to find")
    assert "its details are small. Choose a picture with large shapes, or print it larger" in warning


@pytest.mark.slow
def test_mission_check_says_which_targets_resemble_each_other(tmp_path, astronaut):
    darker = (astronaut * 0.8).astype(np.uint8)
    warnings = check_mission(mission(tmp_path, one=astronaut, two=darker)).warnings
    assert [warning.split(",")[0] for warning in warnings] == [
        "target.one: its picture resembles that of target.two",
        "target.two: its picture resembles that of target.one",
    ]


@pytest.mark.slow
def test_mission_check_says_that_a_detail_resembles_the_whole_where_only_a_close_look_shows_it(tmp_path):
    logo = cv2.imread(str(PICTURES / "logo.png"))
    height, width = logo.shape[:2]
    warnings = check_mission(mission(tmp_path, whole=logo, part=logo[: height // 2, : width // 2])).warnings
    assert any(warning.startswith("target.part: its picture resembles that of target.whole") for warning in warnings)


def test_mission_check_says_that_a_print_is_small(tmp_path, astronaut):
    warnings = check_mission(mission(tmp_path, height_mm=60, small=astronaut)).warnings
    assert any("a print of 60 mm is small: it is found only up to about 0.9 m" in warning for warning in warnings)
