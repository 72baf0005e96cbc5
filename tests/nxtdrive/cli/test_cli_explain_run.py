"""``nxtdrive explain-run``: a run folder explained to people and to programs."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from pathlib import Path

import pytest

from behaviors.journal import JOURNAL_FORMAT
from nxtdrive.cli.main import DONE, main

ROOT = Path(__file__).parents[3]

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("explained runs")]

MISSION = """
[mission]
name = "behind a corner"
targets = ["lena"]
profile = "{profile}"
[target.lena]
detector = "picture"
pictures = ["lena.png"]
[thesis]
wait_s = 7.0
"""

FIRST_FORMAT = Path(__file__).parent / "journals" / "format-1.jsonl"
"""Written before journals named their format; looks are left out."""
SECOND_FORMAT = FIRST_FORMAT.with_name("format-2.jsonl")
"""Written before the chart reported verification, retreats and targets that are left; looks are left out."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[str, Path]:
    """Folders of a run of each profile."""
    home = tmp_path_factory.mktemp("runs")
    folders = {}
    for profile in ("thesis", "adaptive"):
        mission = home / f"{profile}.toml"
        mission.write_text(MISSION.format(profile=profile), encoding="utf-8")
        out = home / profile
        robot = ["--nxt", "sim://figure6", "--camera", "geometric"]
        assert main(["run", str(mission), *robot, "--no-video", "--out", str(out)]) == DONE
        (folders[profile],) = out.iterdir()
    return folders


@pytest.fixture
def explained(printed):
    """Calls the command; gives what it says, as plain values with ``--json``."""

    def explain(path, *arguments):
        out = printed("explain-run", path, *arguments)
        return json.loads(out) if "--json" in arguments else out

    return explain


def test_a_decision_is_reported_with_its_failure_evidence_candidates_choice_and_outcome(runs, explained):
    said = explained(runs["adaptive"])
    for part in ("behind a corner  |  profile adaptive  |  achieved", "failed", "known", "could", "chose", "then"):
        assert part in said
    assert "per success" in said
    assert "lena reached after" in said


def test_a_narrow_terminal_shows_the_estimates_below_each_candidate(runs, explained, monkeypatch):
    wide = explained(runs["adaptive"])
    monkeypatch.setenv("COLUMNS", "40")
    narrow = explained(runs["adaptive"])
    assert max(map(len, narrow.splitlines())) <= 40
    assert "per success" in wide
    assert "candidate " not in narrow
    assert re.search(r"costs \d+ s, chance \d+%,", narrow)


@pytest.mark.nightly  # it renders 83 s of frames
def test_the_documentation_shows_the_first_decision_of_the_built_in_mission(explained, tmp_path):
    assert main(["run", "--profile", "adaptive", "--no-video", "--out", str(tmp_path)]) == DONE
    (run,) = tmp_path.iterdir()
    text = (ROOT / "docs" / "adaptive.md").read_text(encoding="utf-8")
    shown = text[text.index("╭─ 1 ") : text.index("│ then")]
    assert shown in explained(run)


def test_the_same_for_programs(runs, explained):
    told = explained(runs["adaptive"], "--json")
    assert (told["profile"], told["policy"], told["numbers"]) == ("adaptive", "adaptive", "recorded")
    assert told["complete"]
    assert told["ending"] == "achieved"
    for decision in told["decisions"]:
        assert decision["evidence"]["reason"] == decision["reason"]
        (chosen,) = [each for each in decision["candidates"] if each["chosen"]]
        assert chosen["choice"] == decision["chose"]["choice"]
        assert not decision["replay"]["differs"], "the mission's own policy chooses the same again"
        steps = decision["outcome"]["steps"]
        assert decision["outcome"]["seconds"] == pytest.approx(sum(step["seconds"] for step in steps), abs=0.01)
    assert told["decisions"][-1]["outcome"]["result"] == "reached"


def test_another_policy_says_where_it_would_have_chosen_otherwise(runs, explained):
    told = explained(runs["adaptive"], "--profile", "thesis", "--json")
    first = told["decisions"][0]
    assert first["replay"]["choice"]["choice"] in ("wait", "move_to")
    assert first["replay"]["differs"] == (first["replay"]["choice"]["choice"] != first["chose"]["choice"]) or (
        first["replay"]["choice"].get("wait_s") == 7.0
    )
    said = explained(runs["adaptive"], "--profile", "thesis")
    assert "thesis would have chosen differently in" in said
    assert "wait up to 7.0 s" in said, "the mission's own numbers count"


def test_what_a_thesis_journal_lacks_is_not_made_up(runs, explained):
    told = explained(runs["thesis"], "--policy", "adaptive", "--json")
    assert told["profile"] == "thesis"
    assert told["decisions"]
    for decision in told["decisions"]:
        assert decision["replay"]["choice"] is None
        assert "has neither the obstacle" in decision["replay"]["why_not"]
        assert decision["candidates"] == []
    said = explained(runs["thesis"], "--policy", "adaptive")
    assert "unknown: " in said
    assert "the thesis's rule" in said


def test_a_journal_alone_is_enough_and_says_that_the_numbers_are_defaults(runs, explained, tmp_path):
    alone = tmp_path / "old.jsonl"
    alone.write_bytes((runs["adaptive"] / "journal.jsonl").read_bytes())
    told = explained(alone, "--json")
    assert told["numbers"] == "defaults"
    assert all(decision["candidates"] for decision in told["decisions"])
    assert "the adaptive profile's with its default parameters" in explained(alone)


@pytest.mark.parametrize("broken", [None, "{", '{"mission": {"targets": []}}'])
@pytest.mark.parametrize("profile", ["thesis", "adaptive"])
def test_without_a_mission_that_can_be_read_the_profile_is_not_known(runs, explained, tmp_path, profile, broken):
    (tmp_path / "journal.jsonl").write_bytes((runs[profile] / "journal.jsonl").read_bytes())
    if broken is not None:
        (tmp_path / "mission.json").write_text(broken, encoding="utf-8")
    told = explained(tmp_path, "--json")
    assert (told["profile"], told["policy"]) == (None, None)
    assert all(decision["replay"]["choice"] is None for decision in told["decisions"])
    said = explained(tmp_path)
    assert "behind a corner  |  profile not known  |" in said
    assert "mission.json" in said
    assert "the thesis's rule" not in said
    asked = explained(tmp_path, "--profile", "thesis", "--json")
    assert (asked["profile"], asked["policy"]) == (None, "thesis")
    assert all(decision["replay"]["choice"] for decision in asked["decisions"])
    assert "thesis would have chosen differently in" in explained(tmp_path, "--profile", "thesis")


def test_parts_that_failed_are_reported_before_the_decisions(explained, tmp_path):
    journal = tmp_path / "journal.jsonl"
    lines = ['{"t": 0.0, "kind": "start", "state": "idle", "target": "lena", "mission": "m"}']
    common = '"state": "search", "target": "lena"'
    lost = '"kind": "transition", "source": "up", "to": "down", "event": "camera_lost", "reason": "camera_lost"'
    lines.append(f'{{"t": 2.0, {lost}, {common}, "evidence": {{"error": "the camera hangs."}}}}')
    for number in range(10):
        answers = json.dumps(number % 2 == 1)
        sensor = f'"kind": "sensor", "sensor": "bumper", "answers": {answers}, "error": "it sticks"'
        lines.append(f'{{"t": {3.0 + number}, {sensor}, {common}}}')
    journal.write_text("\n".join(lines) + "\n")
    shown = explained(journal)
    assert "2.0 s  the camera hangs." in shown
    assert "3.0 s  continuing without the bumper: it sticks" in shown
    assert "and so on: 11 such lines in all" in shown
    told = explained(journal, "--json")["equipment"]
    assert told[:2] == [
        {"t": 2.0, "what": "the camera hangs."},
        {"t": 3.0, "what": "continuing without the bumper: it sticks"},
    ]
    assert len(told) == 11


@pytest.mark.parametrize(("error", "said"), [("the camera hangs.", 0), ("the policy is broken.", 1)])
def test_an_outage_that_ended_the_run_is_reported_once(explained, tmp_path, error, said):
    common = {"state": "search", "target": "lena"}
    lost = {"source": "up", "to": "down", "event": "camera_lost", "evidence": {"error": "the camera hangs."}}
    journal = tmp_path / "journal.jsonl"
    records = [
        {"t": 0.0, "kind": "start", "mission": "m"},
        {"t": 2.0, "kind": "transition", **lost},
        {"t": 32.0, "kind": "end", "ending": "camera_lost", "error": error},
    ]
    journal.write_text("".join(f"{json.dumps(record | common)}\n" for record in records))
    shown = explained(journal)
    assert shown.count("2.0 s  the camera hangs.") == 1
    assert shown.count(f"error: {error}") == said


def test_a_run_that_was_killed_is_reported_up_to_there(runs, explained, tmp_path):
    journal = (runs["thesis"] / "journal.jsonl").read_bytes()
    cut = tmp_path / "journal.jsonl"
    cut.write_bytes(journal[: journal.index(b'"kind": "choice"') + 600])
    told = explained(cut, "--json")
    assert not told["complete"]
    (decision,) = told["decisions"]
    assert decision["outcome"]["result"] == "journal_ends"
    assert told["damaged_lines"], "the line that was being written"
    assert "unfinished" in explained(cut)


def test_the_hints_of_the_run_are_repeated_at_the_end(runs, explained, tmp_path):
    shutil.copytree(runs["thesis"], tmp_path, dirs_exist_ok=True)
    for hints, said in ((["Is height_mm right?", 7], ["Is height_mm right?"]), ("lost", [])):
        (tmp_path / "summary.json").write_text(json.dumps({"hints": hints}), encoding="utf-8")
        assert explained(tmp_path, "--json")["hints"] == said
        last_line = explained(tmp_path).splitlines()[-1]
        assert (last_line == "hint: Is height_mm right?") == bool(said)


def test_a_journal_of_the_first_format_is_reported_and_its_evidence_understood(explained):
    told = explained(FIRST_FORMAT, "--profile", "adaptive", "--json")
    assert all(each["replay"]["choice"] for each in told["decisions"])
    assert [each["replay"]["differs"] for each in told["decisions"]] == [False] * 4
    assert told["damaged_lines"] == []
    assert "lena has not been recognised since the last search began" in explained(FIRST_FORMAT)


def test_a_narrow_terminal_shows_each_part_of_the_title_on_its_own_line(explained, monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    assert explained(FIRST_FORMAT).splitlines()[:3] == [
        "behind a corner",
        "profile not known",
        "time up after 60.0 s",
    ]


def test_a_terminal_of_no_width_loses_no_text(explained, monkeypatch):
    monkeypatch.setenv("COLUMNS", "0")  # as a program exports it that asked where no terminal is
    assert "behind a corner" in explained(FIRST_FORMAT)


def test_a_journal_of_the_second_format_is_reported(explained):
    told = explained(SECOND_FORMAT, "--json")
    assert len(told["decisions"]) == 5
    assert told["damaged_lines"] == []
    assert "lena given up, search 1.4 s" in explained(SECOND_FORMAT)


def test_a_journal_says_its_format_and_one_of_a_later_version_is_refused(runs, refused, tmp_path):
    first, *rest = (runs["thesis"] / "journal.jsonl").read_text(encoding="utf-8").splitlines()
    start = json.loads(first)
    assert start["format"] == JOURNAL_FORMAT
    later = tmp_path / "journal.jsonl"
    later.write_text("\n".join([json.dumps({**start, "format": JOURNAL_FORMAT + 1}), *rest]), encoding="utf-8")
    assert f"reads formats up to {JOURNAL_FORMAT}" in refused("explain-run", later)


def test_damaged_lines_and_unknown_evidence_do_not_stop_it(runs, explained, tmp_path):
    lines = (runs["adaptive"] / "journal.jsonl").read_text(encoding="utf-8").splitlines()
    lines[1] = "\x00 rubbish"
    choice = next(i for i, line in enumerate(lines) if '"kind": "choice"' in line)
    record = json.loads(lines[choice])
    record |= {"choice": "spin", "evidence": {"reason": "dizzy", "turns": 3}}
    lines[choice] = json.dumps(record)
    journal = tmp_path / "journal.jsonl"
    journal.write_text("\n".join(lines), encoding="utf-8")
    told = explained(journal, "--json")
    assert told["damaged_lines"] == [2]
    assert told["decisions"][0]["chose"]["choice"] == "spin"
    assert "does not understand" in told["decisions"][0]["replay"]["why_not"]
    said = explained(journal)
    assert "turns: 3" in said
    assert "line 2 of the journal cannot be read and is left out" in said


def test_a_run_without_a_decision_says_so(explained, tmp_path):
    journal = tmp_path / "journal.jsonl"
    journal.write_text('{"t": 0.0, "kind": "start", "state": "idle", "target": "lena", "mission": "m"}\n')
    assert "The journal contains no decision: no attempt had failed." in explained(journal)
    assert explained(journal, "--json")["decisions"] == []


@pytest.mark.parametrize(
    ("named", "meant"), [("cat-001", "cat-001"), ("runs/cat-01", "cat-001"), ("dog-002", "dog-002")]
)
def test_a_run_that_is_not_there_leads_to_the_one_of_a_similar_name(refused, here, named, meant):
    for name in ("cat-001", "dog-002"):
        (here / "runs" / name).mkdir(parents=True)
        (here / "runs" / name / "journal.jsonl").touch()
    said = refused("explain-run", named)
    assert f"there is no run {named}. Did you mean {Path('runs', meant)}?" in said


def test_for_the_folder_of_all_runs_the_latest_one_is_named(refused, tmp_path):
    for name, written_s in (("cat-001", 10), ("cat-002", 30), ("dog-001", 20)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "journal.jsonl").touch()
        os.utime(tmp_path / name / "journal.jsonl", (written_s, written_s))
    (tmp_path / "notes.txt").touch()
    assert f"Name the folder of one run, such as {tmp_path / 'cat-002'}." in refused("explain-run", tmp_path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(None, "contains no journal.jsonl"), ("", "is not a journal"), ("no journal\n[1]\n", "is not a journal")],
)
def test_anything_that_is_not_a_run_gives_one_sentence(refused, tmp_path, content, sentence):
    if content is not None:
        (tmp_path / "journal.jsonl").write_text(content)
    assert sentence in refused("explain-run", tmp_path)


def test_a_folder_that_may_not_be_read_is_one_sentence(refused, tmp_path, monkeypatch):
    def denied(path):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(os, "listdir", denied)
    assert f"{tmp_path} cannot be read (Permission denied)" in refused("explain-run", tmp_path)


def test_a_path_to_nothing_is_one_sentence(refused, tmp_path):
    assert "cannot be read" in refused("explain-run", tmp_path / "nowhere")
