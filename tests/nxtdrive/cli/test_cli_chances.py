"""``nxtdrive chances``: counts how often the choices of runs succeeded."""

from __future__ import annotations

import json

import pytest

from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from nxtdrive.cli.main import DONE, main
from tests import small_mission

MISSION = Mission.model_validate(
    {"mission": {"targets": ["a"]}, "target": {"a": {"detector": "color", "color": "red"}}}
)
HERE = {"travel_s": 0.0, "scan_s": 8.0, "chance": 0.25, "route": []}
KNOWN = {"reason": "never_seen", "seen_since_search": False, "researches": 0, "here": HERE}


def _run(folder, seen: bool):
    """Write a run with a second look that shows the target or does not."""
    after = "arrive" if seen else "select"
    moves = [("search", "select"), ("select", "rescan"), ("rescan", after)]
    records = [
        Record(1.0, RecordKind.CHOICE, "select", "a", {"choice": "rescan", "why": "", "evidence": KNOWN}),
        *(
            Record(
                2.0 + i,
                RecordKind.TRANSITION,
                to,
                "a",
                {"source": source, "to": to, "event": "", "reason": "never_seen"},
            )
            for i, (source, to) in enumerate([*moves, (after, "finished")])
        ),
    ]
    folder.mkdir()
    (folder / "journal.jsonl").write_text("".join(record.to_json() + "\n" for record in records))
    (folder / "mission.json").write_text(MISSION.model_dump_json())
    return str(folder)


def test_counts_of_runs_are_shown_and_kept(tmp_path, printed):
    runs = [_run(tmp_path / f"run-{number}", number > 1) for number in range(4)]
    out = tmp_path / "chances.json"
    assert "look again" in printed("chances", *runs, "--out", out)  # as the run itself printed it
    kept = json.loads(out.read_text())
    assert kept["counts"] == {"rescan/0.15/never_seen/0": [2, 2]}
    assert [each["name"] for each in kept["sources"]] == ["run-0", "run-1", "run-2", "run-3"]


def test_a_folder_of_runs_stands_for_all_of_them(tmp_path, refused):
    (tmp_path / "runs").mkdir()
    for number in range(3):
        _run(tmp_path / "runs" / f"run-{number}", seen=True)
    out = tmp_path / "chances.json"
    assert main(["chances", str(tmp_path / "runs"), "--out", str(out)]) == DONE
    assert [each["name"] for each in json.loads(out.read_text())["sources"]] == ["run-0", "run-1", "run-2"]
    (tmp_path / "empty").mkdir()
    assert "contains no journal.jsonl" in refused("chances", tmp_path / "empty")


def test_a_run_with_a_copy_in_its_folder_is_one_run(tmp_path):
    folder, out = _run(tmp_path / "run-1", seen=True), tmp_path / "chances.json"
    _run(tmp_path / "run-1" / "copy", seen=True)
    assert main(["chances", str(folder), "--out", str(out)]) == DONE
    assert [each["name"] for each in json.loads(out.read_text())["sources"]] == ["run-1"]


def test_a_run_may_be_named_by_its_journal_or_be_the_current_folder(tmp_path, monkeypatch):
    folder, out = _run(tmp_path / "run-1", seen=True), tmp_path / "chances.json"
    monkeypatch.chdir(folder)
    for name in (".", "journal.jsonl", f"{folder}/journal.jsonl"):
        assert main(["chances", name, "--out", str(out)]) == DONE
        (source,) = json.loads(out.read_text())["sources"]
        assert (source["name"], source["choices"]) == ("run-1", 1)


def test_lines_of_something_else_are_refused_with_what_to_name(tmp_path, refused):
    (tmp_path / "other.jsonl").write_text("{}\n")
    assert "is not the file of a sweep" in (said := refused("chances", tmp_path / "other.jsonl"))
    assert "Name run folders" in said


def test_counts_of_a_sweep_say_how_it_was_made(tmp_path):
    chance = {"choice": "wait", "reason": "blocked_short", "chance": 0.5, "situation": "wait/0.5/blocked_short/0"}
    line = {
        "episode_index": 0,
        "class": "open",
        "seed": 1,
        "policy": "adaptive",
        "vision": "geometric",
        "success": True,
    }
    line |= {"sum_reward": 0.0, "max_reward": 0.0, "done": True, "ending": "achieved", "error": "", "targets": []}
    line |= {"duration_s": 1.0, "contacts": 0, "chances": [{**chance, "came_true": True, "of_a_later_version": 1}]}
    other = {**line, "episode_index": 1, "policy": "oracle"}
    (tmp_path / "sweep.jsonl").write_text("".join(json.dumps(each) + "\n" for each in (line, other)))
    (tmp_path / "sweep.summary.json").write_text('{"command": ["nxtdrive", "sweep"], "seeds": {"open": [1]}}')
    out = tmp_path / "chances.json"
    assert main(["chances", str(tmp_path / "sweep.jsonl"), "--out", str(out)]) == DONE
    kept = json.loads(out.read_text())
    assert kept["counts"] == {"wait/0.5/blocked_short/0": [1, 0]}
    (source,) = kept["sources"]
    known = {"name": "sweep.jsonl", "choices": 1, "command": ["nxtdrive", "sweep"], "seeds": {"open": [1]}}
    assert known.items() <= source.items()


def test_earlier_counts_are_added(tmp_path):
    out, both = tmp_path / "chances.json", tmp_path / "both.json"
    assert main(["chances", _run(tmp_path / "run-1", True), "--out", str(out)]) == DONE
    assert main(["chances", str(out), _run(tmp_path / "run-2", False), "--out", str(both)]) == DONE
    kept = json.loads(both.read_text())
    assert kept["counts"] == {"rescan/0.15/never_seen/0": [1, 1]}
    assert [each["name"] for each in kept["sources"]] == ["run-1", "run-2"]


def test_counts_alone_are_shown(tmp_path, printed):
    out = tmp_path / "chances.json"
    counts = {"rescan/0.15/never_seen/0": [2, 2], "rescan/0.5/no_way/1": [1, 0], "wait/0.5/blocked_short/0": [0, 1]}
    out.write_text(json.dumps({"sources": [], "counts": counts}))
    shown = [line.split("│")[1:-1] for line in printed("chances", out).splitlines() if line.startswith("│")]
    assert [[each.strip() for each in row] for row in shown] == [["look again", "5", "0.60"], ["wait", "1", "0.00"]]


def test_what_was_counted_is_not_counted_again(here, capsys):
    for number in range(2):
        _run(here / f"run-{number}", seen=True)
    command = ["chances", "run-0", "run-1/journal.jsonl", "chances.json", "--out", "chances.json"]
    assert main([*command[:3], "run-0", *command[4:]]) == DONE
    once = json.loads((here / "chances.json").read_text())
    assert once["counts"] == {"rescan/0.15/never_seen/0": [2, 0]}
    assert main(command) == DONE
    assert json.loads((here / "chances.json").read_text()) == once
    assert "run-0 is not counted: run-0 is in the counts already." in capsys.readouterr().err
    assert main(["chances", "chances.json", *command[3:]]) == DONE
    assert json.loads((here / "chances.json").read_text()) == once


@pytest.mark.parametrize(
    "text",
    [
        "{}",
        "nonsense",
        '{"sources": [], "counts": {"wait": [1]}}',
        '{"counts": 1, "sources": 2}',
        '{"counts": {}, "sources": "runs"}',
    ],
)
def test_a_file_without_counts_is_refused(text, tmp_path, refused):
    (tmp_path / "other.json").write_text(text)
    assert "has no counts. Name run folders" in refused("chances", tmp_path / "other.json").replace("\n", " ")


def test_a_run_of_another_profile_has_no_chances_to_count(tmp_path, capsys, refused):
    run = _run(tmp_path / "run", seen=True)
    settings = MISSION.mission.model_copy(update={"profile": "thesis"})
    text = MISSION.model_copy(update={"mission": settings}).model_dump_json()
    (tmp_path / "run" / "mission.json").write_text(text)
    said = f"{run} is not counted: its profile thesis predicts no chances."
    assert said in refused("chances", run)
    assert main(["chances", run, _run(tmp_path / "adaptive", seen=True)]) == DONE
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["chances", "nothing-there"], ["chances"]])
def test_without_a_run_there_is_nothing_to_count(arguments, capsys):
    try:
        code = main(arguments)
    except SystemExit as error:
        code = error.code
    assert code != DONE
    assert capsys.readouterr().err


@pytest.mark.parametrize("command", ["chances", "explain-run"])
def test_a_narrow_terminal_loses_no_text(command, tmp_path, printed, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    lines = printed(command, _run(tmp_path / "run", seen=True)).splitlines()
    assert max(map(len, lines)) <= 40
    assert not any("…" in line for line in lines)


def test_a_run_that_was_counted_is_not_read_again(tmp_path, capsys):
    folder, out = _run(tmp_path / "run-1", seen=True), tmp_path / "chances.json"
    assert main(["chances", folder, "--out", str(out)]) == DONE
    (tmp_path / "run-1" / "mission.json").unlink()  # which reading the run would report
    capsys.readouterr()
    assert main(["chances", str(out), folder]) == DONE
    assert capsys.readouterr().err == f"{folder} is not counted: run-1 is in the counts already.\n"


def test_counts_of_situations_that_do_not_exist_are_warned_of(tmp_path, capsys):
    mission = tmp_path / "mission.toml"
    mission.write_text(small_mission.MISSION + '[adaptive]\nchances = "counts.json"\n', encoding="utf-8")
    counts = {"detour/0.5/blocked_long/0": [3, 1], "teleport/0.5/blocked_long/0": [1, 2]}
    (tmp_path / "counts.json").write_text(json.dumps({"counts": counts}), encoding="utf-8")
    assert main(["mission", "check", str(mission)]) == DONE
    assert "1 of 2 counts have no effect, 'teleport/0.5/blocked_long/0' for instance" in capsys.readouterr().out
