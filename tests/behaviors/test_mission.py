"""Mission files: valid ones load, invalid ones report all their errors."""

import pickle
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from behaviors.mission import (
    BUILT_IN,
    AdaptiveParameters,
    Mission,
    MissionError,
    MissionTable,
    ThesisParameters,
    load_mission,
    valid_targets,
)
from behaviors.mission.mistakes import mistakes
from behaviors.mission.robot import CameraTable, RobotTable
from behaviors.mission.targets import ColorTarget, PictureTarget
from tests.small_mission import COLOR_MISSION as GOOD

CALIBRATED = "hue_deg = 26, reach_deg = 10, min_saturation_percent = 70, min_value_percent = 20"


def _write(folder: Path, text: str) -> Path:
    path = folder / "mission.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _complaint(folder: Path, text: str) -> str:
    with pytest.raises(MissionError) as caught:
        load_mission(_write(folder, text))
    return str(caught.value)


def test_an_error_lists_the_mistakes_also_for_another_process(tmp_path):
    with pytest.raises(MissionError) as caught:
        load_mission(_write(tmp_path, GOOD + 'size = 1\n[robot]\nleft = "B"\nright = "B"\n'))
    error = pickle.loads(pickle.dumps(caught.value))
    assert [each.partition(":")[0] for each in error.mistakes] == ["target.box.size", "robot"]
    assert str(error).splitlines() == [f"{tmp_path / 'mission.toml'}: 2 mistakes", *(f"  {m}" for m in error.mistakes)]


def test_the_defaults_are_the_thesis(tmp_path):
    thesis = load_mission(_write(tmp_path, GOOD)).thesis
    assert thesis == ThesisParameters()
    numbers = (thesis.wait_s, thesis.turn_deg, thesis.advances, thesis.advance_mm, thesis.max_researches)
    assert numbers == (15.0, 90.0, 10, 150.0, 2)


ODD = ("[[1.0]]", "[{}]", "[[]]", "{}", "{a = 1}", "7", "true", '""', '[""]', '["a", ["b"]]', "nan", "1979-05-27")


@pytest.mark.parametrize(
    "key", ["targets", "detector", "color", "[mission]", "[target.box]", "robot", "camera", "adaptive"]
)
def test_a_value_of_another_type_is_a_mistake_or_has_no_effect(tmp_path, key):
    for value in ODD:
        text, count = re.subn(rf"^{re.escape(key)}.*$", f"{key.strip('[]')} = {value}", GOOD, flags=re.MULTILINE)
        text = text if count else f"{key} = {value}\n{GOOD}"
        try:
            mission = load_mission(_write(tmp_path, text))
        except MissionError:
            continue
        assert mission.model_dump(exclude_unset=True) == tomllib.loads(text), "neither dropped nor changed"


def test_the_built_in_mission_finds_its_pictures_in_another_folder(tmp_path):
    for name in ("lena", "rilakkuma"):
        (tmp_path / f"{name}.png").touch()
    mission = load_mission(BUILT_IN, [tmp_path])
    assert mission.mission.targets == ["lena", "rilakkuma"]
    lena = mission.target["lena"]
    assert isinstance(lena, PictureTarget)
    assert lena.pictures == [str(tmp_path / "lena.png")]


def test_a_world_in_place_of_a_mission_is_called_one(tmp_path):
    said = _complaint(tmp_path, "[floor]\nsize_mm = [3000, 2000]\n[robot]\nstart_mm = [500, 500]")
    assert "is a world, not a mission" in said
    assert "unknown key" not in said


def test_a_robot_file_in_place_of_a_mission_is_called_one(tmp_path):
    for more in ("", f"[color]\nred = {{ {CALIBRATED} }}\n[calibration]\nformat = 1\n"):
        said = _complaint(tmp_path, f"[robot]\nradius_mm = 140\n[camera]\ntilt_deg = -5\n{more}")
        assert "is a robot file, not a mission. Missions use it with --robot " in said


def test_a_file_of_another_program_is_not_checked_key_by_key(tmp_path):
    said = _complaint(
        tmp_path, "[build-system]\nrequires = []\n[project]\nname = 'cat'\n[tool.ruff]\nline-length = 120"
    )
    assert said.endswith("it has no [mission] and no [target.NAME]. `nxtdrive mission new FILE` writes one.")


def test_a_picture_in_place_of_a_mission_is_called_one(tmp_path):
    (cat := tmp_path / "cat.jpg").write_bytes(bytes(300_000))
    with pytest.raises(MissionError, match=r"is a picture, not a mission. `nxtdrive mission new --picture .*cat.jpg"):
        load_mission(cat)


def test_files_may_lie_in_the_users_folder(tmp_path, monkeypatch):
    (home := tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(home))
    (home / "cat.jpg").touch()
    (home / "robot.toml").write_text("[robot]\nradius_mm = 90\n")
    (home / "chances.json").write_text('{"counts": {"wait": [3, 4]}}')
    mission = load_mission(
        _write(
            tmp_path,
            '[mission]\ntargets = ["cat"]\nrobot_file = "~/robot.toml"\n[adaptive]\nchances = "~/chances.json"\n'
            '[target.cat]\ndetector = "picture"\npictures = ["~/cat.jpg"]\n',
        )
    )
    assert mission.target["cat"].pictures == [str(home / "cat.jpg")]
    assert mission.robot.radius_mm == 90
    assert mission.adaptive.chances == {"wait": [3, 4]}


def test_a_picture_that_is_not_a_name_is_one_mistake(tmp_path):
    text = _complaint(tmp_path, '[mission]\ntargets = ["a"]\n[target.a]\ndetector = "picture"\npictures = [3]\n')
    assert text.endswith("mission.toml: 1 mistake\n  target.a.pictures[0]: must be text in quotes, not 3")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "there is no [mission] table"),
        ("[mission]\ntargets = []\n[target]", "a mission needs at least one target"),
        ('[mission]\ntargets = ["lena"]\n[target]', "target 'lena' has no table [target.lena]"),
        ("mission = [", "is not TOML"),
        (
            GOOD + "[robot]\ntouch = 4\n",
            ": 1 mistake\n  robot: ultrasonic and touch both use port 4; give each sensor a port of its own",
        ),
        (GOOD + "[robot]\ncompass = 1\n", "touch and compass both use port 1"),
        (GOOD + "[robot]\nleft = 'D'\n", "robot.left: must be 'A', 'B' or 'C', not 'D'"),
        (GOOD.replace('"red"', '"pink"'), "target.box.color: must be 'red', 'orange'"),
        (GOOD.replace("color = ", "colour = "), "target.box.colour: unknown key; did you mean 'color'?"),
        (
            GOOD.replace('"color"\n', '"colour"\n'),
            "target.box: there is no detector 'colour'; did you mean 'color'?",
        ),
        (GOOD.replace("detector = ", "detecter = "), "'detecter' looks like it, misspelt"),
        (
            '[mission]\ntargets = ["a"]\n[target.a]\ndetector = "yolo"\nmodel = "best.onnx"\nlabel = "cup"',
            "there is no detector 'yolo'; did you mean 'onnx', which has the key model? Else install its package",
        ),
        (
            GOOD + "[adaptive]\nscan_deg_s = 900\n",
            "adaptive.scan_deg_s: must be 120 or less, not 900 (scan_deg_s is a number in degrees per second)",
        ),
        ('[mission]\ntargets = ["a"]\n[target]\na = "lena"', "target.a: it must be a table, [target.a], not 'lena'"),
        ("[mission]\n[target]", "mission.targets: is missing"),
        (GOOD + "[color.red]\nhue_deg = 8\n", "color.red.reach_deg: is missing; `nxtdrive calibrate colors` writes"),
        (
            GOOD + f"[color]\nred = {{ {CALIBRATED.replace('26', '400')} }}\n",
            "color.red.hue_deg: must be less than 360, not 400",
        ),
        (GOOD + f"[color]\nrot = {{ {CALIBRATED} }}\n", "color.rot: must be 'red', 'orange'"),
        (
            '[mission]\ntargets = ["box"]\n[target.box]\ndetector = "marker"',
            "target.box.id: is missing; `nxtdrive mission new FILE` writes an example",
        ),
        (
            '[mission]\ntargets = ["a"]\n[target.a]\ndetector = "picture"\npictures = []',
            "target.a.pictures: must not be empty",
        ),
        ("color = 'red'\n" + GOOD, "color: it must be a table, [color], not 'red'"),
        (
            GOOD + "[camera]\nyaw_radians = 0.1\n",
            "unknown key; did you mean 'yaw_deg' (yaw_deg is a number in degrees)?",
        ),
        (GOOD + "[thesis]\nwiat_s = 3\n", "unknown key; did you mean 'wait_s' (wait_s is a number in seconds)?"),
        (GOOD + "[robot.camera]\nhfov_deg = 50\n", "robot.camera: there is no such table; its keys belong in [camera]"),
        (GOOD + "[mission.robot]\nleft = 'A'\n", "mission.robot: there is no such table; its keys belong in [robot]"),
        (GOOD + "[floor]\nsize_mm = [3000, 2000]\n", "floor: unknown key"),
        (
            '[mission]\ntargets = ["a"]\n[target.a]\ndetector = "qr"\ntext = "7"\nsize_mm = 9',
            "target.a.size_mm: unknown key; known here: detector, height_mm, text",
        ),
        (
            '[mission]\ntargets = ["a"]\n[target.a]\ndetector = "qr"\ntext = "7"\nid = 9',
            "target.a.id: qr targets have no such key; known here: detector, height_mm, text",
        ),
        (GOOD + "[robot]\nultrasonic = 7\n", "robot.ultrasonic: must be 0, 1, 2, 3 or 4, not 7"),
        (GOOD + "[robot]\ntouch = '1'\n", "robot.touch: must be 0, 1, 2, 3 or 4, not '1'"),
        (GOOD + "[robot]\nwheel_diameter_mm = 5.6\n", "robot.wheel_diameter_mm: must be 10 or more, not 5.6"),
        (GOOD.replace('["box"]', '"box"'), "mission.targets: must be a list in brackets, as in [\"box\"], not 'box'"),
        (
            '[mission]\ntargets = ["a"]\n[target.a]\ndetector = "picture"\npictures = "my dog.png"',
            "target.a.pictures: must be a list in brackets, as in [\"my dog.png\"], not 'my dog.png'",
        ),
        (GOOD + "[robot]\nwheel_diameter_mm = '56'\n", "must be a number without quotation marks, not '56'"),
        (GOOD + "[robot]\nwheel_diameter_mm = '56,5'\n", "must be a number without quotation marks, not '56,5'"),
        (
            GOOD.replace("[mission]", "[mission]\nrounds = '2'"),
            "must be a whole number without quotation marks, not '2'",
        ),
        (GOOD.replace('["box"]', "3"), "mission.targets: must be a list in brackets, as in [1, 2], not 3"),
        (GOOD.replace('["box"]', '["bx"]'), "target 'bx' has no table [target.bx]; did you mean 'box'?"),
        (GOOD.replace("[mission]", "[mission]\ncruise_mm_s = 100"), "cruise_mm_s: belongs in the table [thesis] or"),
        (GOOD.replace("[mission]\n", ""), "targets: belongs in the table [mission]"),
        (GOOD.replace('color = "red"', 'color = "red"\nhfov_deg = 50'), "belongs in the table [camera]"),
        (GOOD.replace("[mission]", "[mission]\nheight_mm = 50"), "height_mm: belongs in the table [target.NAME]"),
        (GOOD.replace("[mission]", "[mission]\nrounds = 1.5"), "mission.rounds: must be a whole number, not 1.5"),
        (GOOD + "[adaptive]\ndetours = 'yes'\n", "adaptive.detours: must be true or false, not 'yes'"),
        (GOOD.replace("[mission]", "[mission]\nname = 3"), "mission.name: must be text in quotes"),
        (GOOD.replace("[target.box]", "[target.box]\nheight_mm = inf"), "target.box.height_mm: must be"),
        (GOOD.replace("[target.", "[targets."), "targets: the table of a target is [target.box]"),
        (GOOD.replace("[target.box]", '[targets."my box"]'), 'targets: the table of a target is [target."my box"]'),
        (GOOD.replace("[target.box]", "[target]"), "target.detector: belongs in the table [target.NAME]"),
        (GOOD.replace("[target.box]", "[box]"), "box: there is no such table; its keys belong in [target.NAME]"),
        (GOOD + "[wheels]\nleft = 'A'\ntrack = 3\n", "wheels: there is no such table; its keys belong in [robot]"),
        (GOOD + "[motors]\nleft = 'A'\n", "motors: there is no such table; its keys belong in [robot]"),
        (GOOD + "[camra]\nhfov_deg = 60\n", "camra: unknown key; did you mean 'camera'?"),
        (GOOD.replace("[target.box]", "[[target]]"), "target: it must be a table with a name, [target.NAME], not ["),
        (
            GOOD.replace("[target.box]", "[target.box]\nwidth_mm = 100"),
            "target.box.width_mm: unknown key; leave it out: the height is enough",
        ),
        (GOOD + "[robot]\nwidth_mm = 100\n", "robot.width_mm: unknown key; known here: "),
        (
            GOOD + "[camera]\nsource = 0\n",
            "camera.source: unknown key; name it with --camera, as in --camera 0",
        ),
        (
            GOOD.replace("[mission]", '[mission]\nnxt = "usb://"'),
            "mission.nxt: unknown key; name it with --nxt, as in --nxt usb://",
        ),
        ("mission = 3\n[target]\n", "mission: it must be a table, [mission], not 3"),
    ],
)
def test_one_mistake_one_sentence(tmp_path, text, expected):
    assert expected in _complaint(tmp_path, text)


@pytest.mark.parametrize("name", ["\\u0000/cat.jpg", "~cat\\u0000/cat.jpg"])
@pytest.mark.parametrize(
    "keys", ['detector = "picture"\npictures = ["{}"]', 'detector = "onnx"\nlabel = "cat"\nmodel = "{}"']
)
def test_a_file_with_an_impossible_name_is_one_mistake(tmp_path, keys, name):
    said = _complaint(tmp_path, f'[mission]\ntargets = ["a"]\n[target.a]\n{keys.format(name)}\n')
    assert re.search(r": 1 mistake\n.*: there is no (picture|file) '.*\\x00/cat\.jpg'; put it beside", said)


@pytest.mark.parametrize("written", ["my-kat.jpg", "My-Cat.JPG", "my-cat.jpeg"])
def test_a_picture_of_a_similar_name_is_suggested(tmp_path, written):
    (tmp_path / "my-cat.jpg").write_bytes(b"")
    target = f'[mission]\ntargets = ["a"]\n[target.a]\ndetector = "picture"\npictures = ["{written}"]\n'
    expected = f"there is no picture '{written}'; did you mean 'my-cat.jpg'? Else put it beside the mission file"
    assert expected in _complaint(tmp_path, target)


@pytest.mark.parametrize(
    "key", ['detector = "picture"\npictures = ["{}"]', 'detector = "onnx"\nlabel = "a"\nmodel = "{}"']
)
def test_a_folder_in_place_of_a_file_is_called_that(tmp_path, key):
    (tmp_path / "cat.jpg").mkdir()
    (tmp_path / "car.jpg").mkdir()
    said = _complaint(tmp_path, f'[mission]\ntargets = ["a"]\n[target.a]\n{key.format("cat.jpg")}\n')
    assert "'cat.jpg'; that is a folder, so name a file in it" in said


@pytest.mark.parametrize("name", ["nowhere.toml", "cat.jpg"])
def test_a_missing_file_is_named_and_a_picture_not_called_one(name):
    with pytest.raises(MissionError, match=f"^{name}: cannot be read"):
        load_mission(Path(name))


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


def test_mistakes_of_every_kind_are_reported_in_one_pass(tmp_path):
    text = _complaint(
        tmp_path,
        """
        [mission]
        targets = ["cat", "lena", "box"]
        tragets = 3
        rounds = 99
        [thesis]
        wait_ms = 15000
        advance_mm = 0.15
        turn_deg = "90 degrees"
        [robot]
        left = "C"
        ultrasonic = 1
        stop_mm = 100
        [target.cat]
        detector = "picture"
        pictures = ["nowhere.png"]
        [target.boxx]
        detector = "color"
        color = "rot"
        """,
    )
    for expected in (
        "mission.toml: 12 mistakes",
        "mission.tragets: unknown key; did you mean 'targets'?",
        "mission.rounds: must be 20 or less",
        "thesis.wait_ms: unknown key; did you mean 'wait_s' (wait_s is a number in seconds)?",
        "thesis.advance_mm: must be 10 or more, not 0.15 (advance_mm is a number in milli",
        "thesis.turn_deg: must be a number, not '90 degrees' (turn_deg is a number in degrees)",
        "robot.stop_mm: unknown key",
        "target.boxx.color: must be",
        "robot: left and right both use port C; give each motor a port of its own",
        "ultrasonic and touch both use port 1",
        "target.cat.pictures[0]: there is no picture 'nowhere.png'",
        "target 'lena' has no table [target.lena]",
        "target 'box' has no table [target.box]; did you mean 'boxx'?",
    ):
        assert expected in text


MODELS = {
    "mission": MissionTable,
    "target": ColorTarget,
    "thesis": ThesisParameters,
    "adaptive": AdaptiveParameters,
    "robot": RobotTable,
    "camera": CameraTable,
}
BOX = {"detector": "color", "color": "red"}
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**6), 10**6),
    st.floats(),
    st.text(max_size=5),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.sampled_from(["a", "b"]), st.integers(), max_size=2),
)
KEYS = [(table, key) for table, model in MODELS.items() for key in sorted(model.model_fields)]


@given(st.sampled_from(KEYS), VALUES)
def test_no_mistake_is_reported_in_the_words_of_the_library(place, value):
    (table, key), tables = place, {"mission": {"targets": ["box"]}, "target": {"box": dict(BOX)}}
    (tables["target"]["box"] if table == "target" else tables.setdefault(table, {}))[key] = value
    try:
        Mission.model_validate(tables)
    except ValidationError as error:
        text = "\n".join(mistakes(error, Mission))
        assert not re.search(r"Input|input|literal|valid |instance|float|string|dict|tuple|union|model", text)


def test_targets_without_their_mistakes_can_be_tried(tmp_path):
    path = _write(
        tmp_path,
        """
        rounds = 3
        [mission]
        targets = ["nothing"]
        [target]
        number = 3
        [target.good]
        detector = "qr"
        text = "7"
        height_mm = 100
        [target.low]
        detector = "qr"
        text = "7"
        height_mm = 1
        [target.gone]
        detector = "picture"
        pictures = ["gone.png"]
        [target.empty]
        detector = "qr"
        text = ""
        """,
    )
    assert {name: target.height_mm for name, target in valid_targets(path).items()} == {"good": 100, "low": 297}
    assert valid_targets(_write(tmp_path, "target = 3")) == valid_targets(_write(tmp_path, "no toml")) == {}
