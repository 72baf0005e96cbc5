"""The file of a classroom: every mistake at once, and a classroom without a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from firmware_protocol.errors import ConfigError
from nxtdrive.tools.web.classroom.config import MAX_ROBOTS, ClassroomConfig, read_classroom, simulated_classroom

EXAMPLE = Path(__file__).parents[4] / "examples" / "classroom.toml"


def _read(folder: Path, text: str) -> ClassroomConfig:
    path = folder / "classroom.toml"
    path.write_text(text, encoding="utf-8")
    return read_classroom(path, folder, folder / "runs")


def test_a_number_makes_a_classroom_of_simulated_robots_each_with_its_own_seed(tmp_path):
    robots = simulated_classroom(12, tmp_path, tmp_path / "runs").robots
    assert [robot.name for robot in robots] == [f"Robot {number}" for number in range(1, 13)]
    assert len({str(robot.address) for robot in robots}) == 12
    assert {(robot.address.scheme, robot.address.options["pace"]) for robot in robots} == {("sim", "realtime")}


def test_robots_from_a_number_stand_in_the_room_of_the_mission_and_have_it_as_their_own(tmp_path):
    for name in ("cat.toml", "cat-world.toml"):
        (tmp_path / name).write_text("[mission]\n" if name == "cat.toml" else "[floor]\n", encoding="utf-8")
    robots = simulated_classroom(2, tmp_path, tmp_path / "runs", tmp_path / "cat.toml").robots
    assert [robot.mission for robot in robots] == ["cat.toml", "cat.toml"]
    assert {robot.address.target for robot in robots} == {str(tmp_path / "cat-world.toml")}
    elsewhere = simulated_classroom(2, tmp_path / "other", tmp_path / "runs", tmp_path / "cat.toml").robots
    assert {robot.mission for robot in elsewhere} == {""}


@pytest.mark.parametrize("number", [0, -1, MAX_ROBOTS + 1])
def test_a_class_from_a_number_has_limits(tmp_path, number):
    with pytest.raises(ConfigError, match=f"1 to {MAX_ROBOTS}"):
        simulated_classroom(number, tmp_path, tmp_path)


def test_listed_robots_come_first_and_keep_what_they_say(tmp_path):
    config = _read(
        tmp_path,
        """
        [classroom]
        name = "7b"
        runs = "kept"
        simulated = 2
        world = "open"
        [[robot]]
        name = "Robot 1"
        color = "#123456"
        nxt = "usb://0016530A1B2C"
        camera = "0"
        fall_back = true
        [[robot]]
        name = "Zoë"
        nxt = "sim://room?seed=9"
        camera = "sim"
        """,
    )
    assert [robot.name for robot in config.robots] == ["Robot 1", "Zoë", "Robot 2", "Robot 3"]
    real, own_world, made, _ = config.robots
    assert (str(real.address), real.camera, real.color) == ("usb://0016530A1B2C", "0", "#123456")
    assert (real.stand_in.target, own_world.stand_in) == ("open", None)
    assert (str(own_world.address), own_world.camera) == ("sim://room?seed=9&pace=realtime", "sim")
    assert (made.address.target, made.camera) == ("open", "geometric")
    assert config.runs == tmp_path / "kept"


def test_a_world_file_of_one_robot_is_looked_for_beside_the_file(tmp_path):
    (tmp_path / "lab.toml").write_text(
        "[floor]\nsize_mm = [4000, 3000]\n[robot]\nstart_mm = [400, 1500]\n", encoding="utf-8"
    )
    config = _read(tmp_path, '[[robot]]\nname = "Ada"\nnxt = "sim://lab.toml?seed=7"\n')
    (ada,) = config.robots
    assert (ada.address.target, ada.address.options["seed"]) == (str(tmp_path / "lab.toml"), "7")


NOWHERE = '[classroom]\nworld = "nowhere"\n'
ADA = '[[robot]]\nname = "Ada"\nnxt = "usb://"\nmission = "nosuch.toml"\n'


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            NOWHERE + ADA + '[[robot]]\nname = "ada"\nnxt = "usb://"\ncamera = "geometric"\n[[robot]]\nname = "NUL"\n',
            ["nowhere", "nosuch.toml", "name 'ada'", "nxt 'usb://'", "geometric", "NUL"],
        ),
        # a value of the wrong form hides no other mistake
        (NOWHERE + ADA + "[[robot]]\nname = 3\n", ["3 mistakes", "robot[1].name", "nosuch.toml", "nowhere"]),
        (
            '[[robot]]\nname = "Ada"\n[[robot]]\nname = "ada"\n[[robot]]\nname = "Bo"\ncolor = "red"',
            ["2 mistakes", "2 robots have the name 'ada'", "#rrggbb"],
        ),
    ],
)
def test_every_mistake_of_a_file_is_reported_at_once(tmp_path, text, parts):
    with pytest.raises(ConfigError) as raised:
        _read(tmp_path, text)
    for part in parts:
        assert part in str(raised.value)


def test_after_a_table_of_the_wrong_form_no_mission_is_looked_for_in_another_folder(tmp_path):
    with pytest.raises(ConfigError) as raised:
        _read(tmp_path, '[classroom]\nmissions = 3\n[[robot]]\nname = "Ada"\nmission = "there.toml"\n')
    assert "1 mistake:\n  classroom.missions" in str(raised.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no robots"),
        ("[classroom]\nsimulated = 31", "30 or less"),
        (f'[classroom]\nsimulated = 2\nworld = "{"x" * 300}"', "world"),
        ('[classroom]\nsimulated = 30\n[[robot]]\nname = "Ada"', "31 robots"),
        ('[[robot]]\nname = "../up"', "letters, digits"),
        ('[[robot]]\nname = ""', "letters, digits"),
        ('[[robot]]\nname = "Ada "', "letters, digits"),
        ('[[robot]]\nname = "Ada"\ncolor = "red"', "#rrggbb"),
        ('[[robot]]\nname = "Ada"\ncolour = "#ffffff"', "color"),
        ('[[robot]]\nname = "Ada"\nnxt = "what is this"', "not an address"),
        ('[[robot]]\nname = "Ada"\nnxt = "usv://"', "usb://"),
        ('[[robot]]\nname = "Ada"\nnxt = 7', "text in quotes"),
        ('[robot]\nname = "Ada"', "robot"),
        ("[classroom]\nsimulated = true", "whole number"),
        ('[classroom]\nsimulated = 2\nmissions = "nosuch"', "missions: there is no folder"),
        (f'[classroom]\nsimulated = 2\nmissions = "{"x" * 300}"', "missions: there is no folder"),
        ("[classroom", "TOML"),
    ],
)
def test_a_mistake_is_named(tmp_path, text, says):
    with pytest.raises(ConfigError, match=says):
        _read(tmp_path, text)


def test_the_missions_of_robots_are_checked(tmp_path):
    (tmp_path / "bad.toml").write_text("[mission]\ntargets = []\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="at least one target"):
        _read(tmp_path, '[[robot]]\nname = "Ada"\nmission = "bad.toml"')


def test_the_example_is_valid():
    assert len(read_classroom(EXAMPLE, Path(), Path("runs")).robots) == 12
