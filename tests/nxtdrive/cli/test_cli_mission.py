"""``nxtdrive mission``: all mistakes at once, and all numbers in one view."""

import json

import cv2
import pytest

from behaviors.diagram import mermaid, transition_table
from behaviors.mission import BUILT_IN, AdaptiveParameters, MissionError, ThesisParameters, load_mission
from behaviors.mission.targets import MAX_PICTURES, MAX_TARGETS
from nxtdrive.cli.main import DONE, USAGE, exit_code, main
from nxtdrive.cli.templates.mission import meanings, template
from nxtdrive.tools.web.missions import Missions
from sim_backend.bundled import PICTURES
from tests.small_mission import COLOR_MISSION as GOOD

BAD = '[mission]\ntargets = ["box"]\n[target.box]\ndetector = "color"\ncolor = "mauve"\n[thesis]\nwait_ms = 3\n'


@pytest.fixture
def good(tmp_path):
    path = tmp_path / "good.toml"
    path.write_text(GOOD, encoding="utf-8")
    return path


@pytest.fixture
def bad(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(BAD, encoding="utf-8")
    return path


def test_a_good_file_is_called_good(good, printed):
    assert "good.toml: good" in printed("mission", "check", good)


def test_every_mistake_of_every_file_is_listed(good, bad, tmp_path, capsys):
    missing = tmp_path / "missing.toml"
    assert main(["mission", "check", str(bad), str(good), str(missing)]) == USAGE
    captured = capsys.readouterr()
    assert "'red'" in captured.err
    assert "wait_ms" in captured.err
    assert "missing.toml" in captured.err
    assert "good.toml: good" in captured.out


def test_pictures_and_cascades_are_tried(tmp_path, capsys):
    path, text = tmp_path / "unusable.toml", tmp_path / "cat.jpg"
    text.write_text("no picture")
    path.write_text(
        '[mission]\ntargets = ["face", "cat"]\n[target.face]\ndetector = "haar"\ncascade = "nobody"\n'
        '[target.cat]\ndetector = "picture"\npictures = ["cat.jpg"]\n',
        encoding="utf-8",
    )
    assert main(["mission", "check", "--json", str(path)]) == USAGE
    face, cat = json.loads(capsys.readouterr().out)[0]["mistakes"]
    assert face.startswith("target.face: there is no cascade 'nobody'")
    assert cat.startswith("target.cat: ")


RED = '[target.t{}]\ndetector = "color"\ncolor = "red"\n'
GONE = '[target.t{}]\ndetector = "picture"\npictures = ["gone.png"]\n'


@pytest.mark.parametrize(("target", "mistakes"), [(RED, 1), (GONE, 1 + MAX_TARGETS)])
def test_a_mission_with_more_targets_than_fit_in_memory_is_refused(tmp_path, refused, target, mistakes):
    path = tmp_path / "many.toml"
    path.write_text('[mission]\ntargets = ["t0"]\n' + "".join(map(target.format, range(2 * MAX_TARGETS))))
    said = refused("mission", "check", path)
    assert f"many.toml: {mistakes} mistake" in said
    assert f"target: must have at most {MAX_TARGETS} entries" in said


@pytest.mark.parametrize("picture", ["lena.png", "gone.png"])
def test_a_target_with_more_pictures_than_fit_in_memory_is_refused(tmp_path, refused, picture):
    path, pictures = tmp_path / "many.toml", [picture] * 2 * MAX_PICTURES
    path.write_text(f'[mission]\ntargets = ["t"]\n[target.t]\ndetector = "picture"\npictures = {pictures}\n')
    said = refused("mission", "check", path)
    assert f"many.toml: {1 if picture == 'lena.png' else 1 + MAX_PICTURES} mistake" in said
    assert f"target.t.pictures: must have at most {MAX_PICTURES} entries" in said


def test_mistakes_in_keys_ports_and_pictures_are_found_in_one_pass(tmp_path, capsys):
    (tmp_path / "cat.jpg").write_text("no picture")
    path = tmp_path / "all.toml"
    path.write_text(
        '[mission]\ntargets = ["cat", "dog", "fox"]\nrounds = 0\n[robot]\nleft = "C"\n'
        '[target.cat]\ndetector = "picture"\npictures = ["cat.jpg"]\nheight_mm = -1\n'
        '[target.dog]\ndetector = "picture"\npictures = ["dog.jpg"]\n',
        encoding="utf-8",
    )
    assert main(["mission", "check", "--json", str(path)]) == USAGE
    found = json.loads(capsys.readouterr().out)[0]["mistakes"]
    starts = (
        "mission.rounds: must",
        "robot: left",
        "mission.targets: target 'fox'",
        "target.cat.height_mm",
        "target.dog.pictures",
        "target.cat: ",
    )
    for start in starts:
        assert [line for line in found if line.startswith(start)], start
    assert len(found) == len(starts)


def test_mistakes_in_the_robot_file_name_that_file(tmp_path, capsys):
    robot, mission = tmp_path / "robot.toml", tmp_path / "mission.toml"
    robot.write_text("robt = 1\n[camera]\nhfov_deg = 5\n", encoding="utf-8")
    mission.write_text('[mission]\ntargets = ["tag"]\n[target.tag]\ndetector = "marker"\nid = 7\n', encoding="utf-8")
    assert main(["mission", "check", "--robot", str(robot), "--json", str(mission)]) == USAGE
    found = json.loads(capsys.readouterr().out)[0]["mistakes"]
    assert len(found) == 2
    assert all(line.startswith(f"{robot}: ") for line in found)
    checked = Missions(tmp_path, robot).check(mission.read_text(encoding="utf-8"))
    assert checked.mistakes == found
    mission.write_text('[mission]\ntargets = ["tag"]\n[target.tag]\ndetector = "marker"\nid = -7\n', encoding="utf-8")
    assert main(["mission", "check", "--robot", str(robot), "--json", str(mission)]) == USAGE
    both = json.loads(capsys.readouterr().out)[0]["mistakes"]
    assert both[0].startswith("target.tag.id: ")
    assert both[1:] == found


def _picture(folder, width, height):
    path = folder / f"{width}x{height}.png"
    cv2.imwrite(str(path), cv2.resize(cv2.imread(str(PICTURES / "lena.png")), (width, height)))
    return path.name


@pytest.mark.parametrize(
    ("size", "keys", "expected"),
    [
        ((210, 297), "", None),
        ((297, 210), "", "an A4 sheet in landscape is 210 mm high"),
        ((200, 200), "", "height_mm is missing"),
        ((297, 210), "height_mm = 210", None),
        ((210, 297), "height_mm = 205", None),
        ((210, 297), "height_mm = 250", "no sheet is 250 mm high (portrait: A3 420, A4 297, A5 210, A6 148)"),
        ((297, 210), "height_mm = 250", "no sheet is 250 mm high (landscape: A3 297, A4 210, A5 148, A6 105)"),
        ((900, 60), "height_mm = 200", "3000 mm wide"),
        ((60, 900), "height_mm = 200", "13 mm wide"),
        ((300, 400), "height_mm = 1000", "Set arrive_mm = 1330"),
        ((300, 400), "height_mm = 1000\n[adaptive]\narrive_mm = 1330", None),
        ((210, 280), "height_mm = 20", "Is it in centimetres?"),
    ],
)
def test_a_size_that_is_hardly_meant_is_a_warning(size, keys, expected, tmp_path, printed):
    path = tmp_path / "size.toml"
    picture = _picture(tmp_path, *size)
    head = '[mission]\ntargets = ["cat"]\n[target.cat]\ndetector = "picture"\n'
    path.write_text(f'{head}pictures = ["{picture}"]\n{keys}\n', encoding="utf-8")
    out = printed("mission", "check", path)
    assert (expected or "good") in out
    assert ("warning" in out) is (expected is not None)


@pytest.mark.parametrize(
    ("keys", "usual"), [('detector = "marker"\nid = 7', 150), ('detector = "qr"\ntext = "7"', 160)]
)
def test_a_marker_or_code_without_a_height_is_a_warning(keys, usual, tmp_path, printed):
    path = tmp_path / "sheet.toml"
    path.write_text(f'[mission]\ntargets = ["sheet"]\n[target.sheet]\n{keys}\n', encoding="utf-8")
    out = printed("mission", "check", path)
    assert f"height_mm is missing, so 297 is assumed; the sheet that `nxtdrive mission new` writes has {usual}" in out
    path.write_text(f"{path.read_text(encoding='utf-8')}height_mm = {usual}\n", encoding="utf-8")
    assert "warning" not in printed("mission", "check", path)


def test_a_run_begins_with_the_warnings(tmp_path, capsys):
    path = tmp_path / "twice.toml"
    path.write_text(GOOD.replace('["box"]', '["box", "box"]'), encoding="utf-8")
    assert main(["run", str(path), "--nxt", "sim://nowhere"]) == USAGE
    assert "nxtdrive: warning: mission.targets: 'box' is listed 2 times" in capsys.readouterr().err


def test_mistakes_as_json(good, bad, capsys):
    assert main(["mission", "check", "--json", str(good), str(bad)]) == USAGE
    first, second = json.loads(capsys.readouterr().out)
    assert first == {"file": str(good), "mistakes": [], "warnings": []}
    assert len(second["mistakes"]) == 2


def test_show_prints_numbers_and_table(good, printed):
    text = printed("mission", "show", good)
    assert transition_table() in text
    assert mermaid() not in text
    rows = {line[2:].split()[0]: line for line in text.splitlines() if line.startswith(("* ", "  ")) and line.strip()}
    assert rows["color"].startswith("* color")
    assert rows["arrive_mm"].split()[:2] == ["arrive_mm", f"{ThesisParameters().arrive_mm:g}"]
    assert "Apparent distance" in rows["arrive_mm"]
    assert rows["detours"].split()[1] == "true"
    assert rows["fixed_wait_s"].split()[1] == "none"


def test_show_prints_the_diagram_alone(good, printed):
    assert printed("mission", "show", "--diagram", good).rstrip() == mermaid().rstrip()


def test_show_says_which_profiles_numbers_count(good, printed):
    text = printed("mission", "show", good)
    assert "[adaptive]\n" in text
    assert "[thesis]   no effect except continue_every_s: the profile is adaptive" in text


def test_show_says_nothing_of_numbers_that_a_profile_from_a_package_may_use(here, printed):
    (here / "eager.py").write_text("from behaviors.profiles.adaptive import AdaptiveProfile as Eager\n")
    path = here / "mission.toml"
    assert main(["mission", "new", str(path)]) == DONE
    path.write_text(path.read_text().replace('profile = "adaptive"', 'profile = "eager:Eager"'))
    assert "no effect" not in printed("mission", "show", path)


def test_show_without_a_file_is_the_built_in_mission(answered):
    assert answered("mission", "show")["mission"]["targets"] == ["lena", "rilakkuma"]


def test_show_of_a_bad_file_is_one_message(bad, refused):
    assert "2 mistakes" in refused("mission", "show", bad)


def test_a_new_file_is_good_and_never_overwritten(tmp_path, capsys):
    path = tmp_path / "new.toml"
    assert main(["mission", "new", str(path)]) == DONE
    assert main(["mission", "check", str(path)]) == DONE
    before = path.read_text(encoding="utf-8")
    assert main(["mission", "new", str(path)]) == USAGE
    assert path.read_text(encoding="utf-8") == before
    assert "exists already" in capsys.readouterr().err


def test_a_new_file_that_cannot_be_written_is_one_sentence(tmp_path, refused):
    assert "cannot be written" in refused("mission", "new", tmp_path / "nowhere" / "new.toml")


def test_the_template_says_the_defaults(tmp_path):
    path = tmp_path / "new.toml"
    lines = template().splitlines()
    path.write_text(template(), encoding="utf-8")
    as_it_is = load_mission(path)
    start = lines.index("[adaptive]")
    path.write_text("\n".join([*lines[:start], *(line.removeprefix("# ") for line in lines[start:])]), encoding="utf-8")
    assert load_mission(path) == as_it_is


@pytest.mark.parametrize("profile", [ThesisParameters, AdaptiveParameters])
def test_every_number_of_a_profile_has_a_meaning(profile):
    assert set(meanings(profile)) == set(profile.model_fields)


def test_a_mission_error_is_a_usage_error():
    assert exit_code(MissionError("two mistakes")) == USAGE


def test_a_robot_file_describes_the_robot_of_the_built_in_mission_too(tmp_path, monkeypatch):
    robot = tmp_path / "robot.toml"
    robot.write_text('[robot]\nleft = "A"\n[camera]\nhfov_deg = 70\n', encoding="utf-8")
    mission = load_mission(BUILT_IN, [PICTURES], robot=robot)
    assert (mission.robot.left, mission.camera.hfov_deg) == ("A", 70)


def test_a_face_without_a_height_is_not_taken_for_a_sheet_in_silence(tmp_path, printed):
    path = tmp_path / "face.toml"
    text = '[mission]\ntargets = ["face"]\n[target.face]\ndetector = "haar"\n'
    path.write_text(text, encoding="utf-8")
    said = " ".join(printed("mission", "check", path).split())
    assert "target.face: height_mm is missing, so 297 is assumed, that of an A4 sheet; 200 is usual for a face." in said
    path.write_text(text + 'cascade = "haarcascade_eye"\n', encoding="utf-8")
    assert "so 297 is assumed, that of an A4 sheet. Measure" in " ".join(printed("mission", "check", path).split())
    path.write_text(text + "height_mm = 200\n", encoding="utf-8")
    assert "height_mm" not in printed("mission", "check", path)


@pytest.mark.parametrize("written", ["cat", "cat.tml", "cats.toml"])
def test_a_mission_by_a_name_that_is_nearly_right_is_suggested(written, here, refused):
    (here / "cat.toml").touch()
    (here / "cat.d").mkdir()
    for command in (["run"], ["mission", "check"], ["doctor", "--mission"]):
        assert "cannot be read (No such file or directory). Did you mean cat.toml?" in refused(*command, written)
