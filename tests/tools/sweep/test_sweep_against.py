"""A sweep is compared with the file of another one, mission by mission."""

import json

import pytest
from sweep_results import mission_result, target_result

from nxtdrive.cli.main import main


def _file(path, *results):
    path.write_text("".join(result.to_json() + "\n" for result in results), encoding="utf-8")
    return path


def _mission(kind, seed, time_s, **values):
    return mission_result(target_result(time_s, sct=0.5), kind=kind, seed=seed, **values)


@pytest.fixture
def sweep(tmp_path):
    """Return a function that compares a finished sweep of four missions with another file."""
    names = [("open", 1, 20.0), ("open", 2, 30.0), ("far", 1, 50.0), ("far", 2, 70.0)]
    out = _file(tmp_path / "new.jsonl", *(_mission(kind, seed, time_s) for kind, seed, time_s in names))
    which = ["--classes", "open,far", "--seeds", "1-2", "--agents", "adaptive", "--out", str(out), "--resume"]
    return lambda other, *options: main(["sweep", *which, "--against", str(other), *options])


def test_differences_are_paired_by_mission_for_each_class_and_together(sweep, tmp_path, capsys):
    """The other sweep has no target of open:2, and neither far:2 nor another class counts."""
    missed = [_mission("open", 1, 20.0), _mission("open", 2, None), _mission("far", 1, 50.0), _mission("dim", 1, None)]
    assert sweep(_file(tmp_path / "old.jsonl", *missed), "--json") == 0
    found = json.loads(capsys.readouterr().out)["against"]["policies"]["adaptive"]
    assert list(found) == ["open", "far", "together"]
    success = {kind: (each["success"]["mean"], each["success"]["number"]) for kind, each in found.items()}
    assert success == {"open": (0.5, 2), "far": (0.0, 1), "together": (pytest.approx(1 / 3), 3)}
    assert found["open"]["SCT"]["mean"] == 0.25


def test_the_length_of_missions_is_compared_too(sweep, tmp_path, capsys):
    longer = [_mission("open", seed, 20.0, duration_s=130.0) for seed in (1, 2)]
    assert sweep(_file(tmp_path / "old.jsonl", *longer), "--json") == 0
    found = json.loads(capsys.readouterr().out)["against"]["policies"]["adaptive"]
    assert found["open"]["mission s"]["mean"] == _mission("open", 1, 20.0).duration_s - 130.0


def test_the_table_names_the_file(sweep, tmp_path, capsys):
    assert sweep(_file(tmp_path / "old.jsonl", _mission("open", 1, None), _mission("open", 2, None))) == 0
    out = capsys.readouterr().out
    assert "old.jsonl, paired [95 %]" in out
    assert "+1.000 [+1.000, +1.000]" in out


@pytest.mark.parametrize(
    ("results", "complaint"),
    [
        ([_mission("dim", 1, 20.0)], "has none of these missions"),
        ([_mission("open", 1, 20.0, agent="thesis")], "has none of these missions"),
        ([_mission("open", 1, 20.0), _mission("open", 1, 20.0, vision="camera")], "has missions several times"),
    ],
)
def test_a_file_that_cannot_be_compared_is_refused_before_a_mission_is_run(sweep, tmp_path, capsys, results, complaint):
    before = (tmp_path / "new.jsonl").read_bytes()
    assert sweep(_file(tmp_path / "old.jsonl", *results)) == 2
    assert complaint in capsys.readouterr().err
    assert (tmp_path / "new.jsonl").read_bytes() == before
    assert not (tmp_path / "new.summary.json").exists()


def test_a_file_that_does_not_exist_is_refused(sweep, tmp_path, capsys):
    assert sweep(tmp_path / "missing.jsonl") == 2
    assert "missing.jsonl is no file" in capsys.readouterr().err


def test_a_file_of_something_else_is_refused_with_the_option_that_named_it(sweep, tmp_path, capsys):
    (tmp_path / "old.jsonl").write_text('{"kind": "start"}\n', encoding="utf-8")
    assert sweep(tmp_path / "old.jsonl") == 2
    said = capsys.readouterr().err
    assert "old.jsonl is not the file of a sweep" in said
    assert "--against" in said
    assert "--out" not in said
