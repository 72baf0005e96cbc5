"""``nxtdrive mission``: everything that is wrong at once, everything that counts in one view."""

import json

import pytest

from behaviors.diagram import mermaid, transition_table
from behaviors.mission import AdaptiveParameters, MissionError, ThesisParameters, load_mission
from nxtdrive.cli.main import DONE, USAGE, exit_code, main
from nxtdrive.cli.mission_template import meanings, template

GOOD = '[mission]\ntargets = ["box"]\n[target.box]\ndetector = "color"\ncolor = "red"\n'
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


def test_a_good_file_is_called_good(good, capsys):
    assert main(["mission", "check", str(good)]) == DONE
    assert "good.toml: good" in capsys.readouterr().out


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
    assert face.startswith("target.face: There is no cascade 'nobody'")
    assert cat.startswith("target.cat: ")


def test_mistakes_as_json(good, bad, capsys):
    assert main(["mission", "check", "--json", str(good), str(bad)]) == USAGE
    first, second = json.loads(capsys.readouterr().out)
    assert first == {"file": str(good), "mistakes": []}
    assert len(second["mistakes"]) == 2


def test_show_prints_numbers_table_and_diagram(good, capsys):
    assert main(["mission", "show", str(good)]) == DONE
    text = capsys.readouterr().out
    assert transition_table() in text
    assert mermaid() in text
    rows = {line[2:].split()[0]: line for line in text.splitlines() if line.startswith(("* ", "  ")) and line.strip()}
    assert rows["color"].startswith("* color")
    assert rows["arrive_mm"].split()[:2] == ["arrive_mm", f"{ThesisParameters().arrive_mm:g}"]
    assert "Apparent distance" in rows["arrive_mm"]


def test_show_says_which_profiles_numbers_count(good, capsys):
    assert main(["mission", "show", str(good)]) == DONE
    text = capsys.readouterr().out
    assert "[adaptive]\n" in text
    assert "[thesis]   no effect" in text


def test_show_without_a_file_is_the_built_in_mission(capsys):
    assert main(["mission", "show", "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["mission"]["targets"] == ["lena", "rilakkuma"]


def test_show_of_a_bad_file_is_one_message(bad, capsys):
    assert main(["mission", "show", str(bad)]) == USAGE
    assert "2 mistakes" in capsys.readouterr().err


def test_a_new_file_is_good_and_never_overwritten(tmp_path, capsys):
    path = tmp_path / "new.toml"
    assert main(["mission", "new", str(path)]) == DONE
    assert main(["mission", "check", str(path)]) == DONE
    before = path.read_text(encoding="utf-8")
    assert main(["mission", "new", str(path)]) == USAGE
    assert path.read_text(encoding="utf-8") == before
    assert "exists already" in capsys.readouterr().err


def test_a_new_file_that_cannot_be_written_is_one_sentence(tmp_path, capsys):
    assert main(["mission", "new", str(tmp_path / "nowhere" / "new.toml")]) == USAGE
    assert "cannot be written" in capsys.readouterr().err


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
