"""Mission files: valid ones load, invalid ones report all their errors."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.mission import BUILT_IN, MissionError, PictureTarget, ThesisParameters, load_mission

GOOD = """
[mission]
targets = ["box"]
[target.box]
detector = "color"
color = "red"
"""


def _write(folder: Path, text: str) -> Path:
    path = folder / "mission.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _complaint(folder: Path, text: str) -> str:
    with pytest.raises(MissionError) as caught:
        load_mission(_write(folder, text))
    return str(caught.value)


def test_the_defaults_are_the_thesis(tmp_path):
    thesis = load_mission(_write(tmp_path, GOOD)).thesis
    assert thesis == ThesisParameters()
    numbers = (thesis.wait_s, thesis.turn_deg, thesis.advances, thesis.advance_mm, thesis.max_researches)
    assert numbers == (15.0, 90.0, 10, 150.0, 2)


def test_the_built_in_mission_finds_its_pictures_in_another_folder(tmp_path):
    for name in ("lena", "rilakkuma"):
        (tmp_path / f"{name}.png").touch()
    mission = load_mission(BUILT_IN, [tmp_path])
    assert mission.mission.targets == ["lena", "rilakkuma"]
    lena = mission.target["lena"]
    assert isinstance(lena, PictureTarget)
    assert lena.pictures == [str(tmp_path / "lena.png")]


def test_every_mistake_is_reported_at_once_with_its_path(tmp_path):
    text = _complaint(
        tmp_path,
        """
        [mission]
        targets = ["lena"]
        tragets = 3
        [thesis]
        wait_ms = 15000
        advance_mm = 0.15
        turn_deg = "90 degrees"
        [robot]
        left = "B"
        right = "B"
        [target.lena]
        detector = "picture"
        pictures = ["nowhere.png"]
        """,
    )
    for expected in (
        "mission.toml: 6 mistakes",
        "mission.tragets: unknown key; did you mean 'targets'?",
        "thesis.wait_ms: unknown key; did you mean 'wait_s' (wait_s is a number in seconds)?",
        "thesis.advance_mm: Input should be greater than or equal to 10, not 0.15 (advance_mm is a number in milli",
        "thesis.turn_deg: Input should be a valid number, not '90 degrees' (turn_deg is a number in degrees)",
        "robot: left and right both use port B; give each motor a port of its own",
        "target.lena.pictures[0]: there is no picture 'nowhere.png'",
    ):
        assert expected in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "there is no [mission] table"),
        ("[mission]\ntargets = []\n[target]", "a mission needs at least one target"),
        ('[mission]\ntargets = ["lena"]\n[target]', "target 'lena' has no table [target.lena]"),
        ("mission = [", "not a TOML file"),
        (GOOD + "[robot]\ntouch = 4\n", "ultrasonic and touch both use port 4"),
        (GOOD + "[robot]\ncompass = 1\n", "touch and compass both use port 1"),
        (GOOD + "[robot]\nleft = 'D'\n", "robot.left: Input should be 'A', 'B' or 'C', not 'D'"),
        (GOOD.replace('"red"', '"pink"'), "target.box.color: Input should be 'red'"),
        (GOOD.replace("color = ", "colour = "), "target.box.colour: unknown key; did you mean 'color'?"),
        (
            GOOD.replace('"color"\n', '"colour"\n'),
            "target.box: there is no detector 'colour'; use one of picture, haar",
        ),
        (GOOD.replace("detector = ", "detecter = "), "'detecter' looks like it, misspelt"),
        ('[mission]\ntargets = ["a"]\n[target]\na = "lena"', "target.a: it must be a table, [target.a], not 'lena'"),
        ("[mission]\n[target]", "mission.targets: is missing"),
        ('[mission]\ntargets = ["box"]\n[target.box]\ndetector = "marker"', "target.box.id: is missing"),
        ("mission = 3\n[target]\n", "mission: it must be a table, [mission], not 3"),
    ],
)
def test_one_mistake_one_sentence(tmp_path, text, expected):
    assert expected in _complaint(tmp_path, text)


@pytest.mark.parametrize("key", ["reconnect_timeout_s", "link_patience_s"])
def test_the_timeout_of_outages_may_have_its_old_name(tmp_path, key):
    text = f'[mission]\ntargets = ["m"]\n{key} = 7.5\n[target.m]\ndetector = "marker"\nid = 1\n'
    mission = load_mission(_write(tmp_path, text))
    assert mission.mission.reconnect_timeout_s == 7.5
    assert '"reconnect_timeout_s":7.5' in mission.model_dump_json()
    assert f"mission.{key}" in _complaint(tmp_path, text.replace("7.5", "-1"))


def test_a_missing_file_is_named():
    with pytest.raises(MissionError, match=r"nowhere\.toml: cannot be read"):
        load_mission(Path("nowhere.toml"))


@given(st.text(max_size=200))
def test_any_text_loads_or_is_refused_with_a_mission_error(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("any") / "mission.toml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(MissionError):
        load_mission(path)


def test_a_mission_has_a_time_limit_of_ten_minutes_unless_it_sets_another(tmp_path):
    assert load_mission(_write(tmp_path, GOOD)).mission.time_limit_s == 600.0
    longer = GOOD.replace("[mission]", "[mission]\ntime_limit_s = 1800")
    assert load_mission(_write(tmp_path, longer)).mission.time_limit_s == 1800
