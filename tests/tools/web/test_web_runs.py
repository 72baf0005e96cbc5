"""The list of runs, and the data of the replay, of any folder, however damaged."""

from __future__ import annotations

import json
import os

import pytest

from behaviors.journal import Record, RecordKind
from behaviors.profiles import registry
from firmware_protocol.errors import ConfigError
from nxtdrive.mission.files import read_mission_file, with_profile
from nxtdrive.tools.web import app
from nxtdrive.tools.web.runs import Runs
from tests.tools.web.pages import client_of, server_of

JOURNAL = [
    Record(0.0, RecordKind.START, "idle", "lena", {"format": 2, "mission": "<b>a mission</b>", "targets": ["lena"]}),
    Record(4.5, RecordKind.LOOK, "search", "lena", {"pose": [0, 0, 0], "range_mm": None, "sighting": None}),
]
WRITTEN_S = 1_600_000_000.0
SUMMARY = {"mission": "m", "ending": "achieved", "achieved": True, "duration_s": 4.5}
LOOK = {"target": "lena", "sighting": None, "found": [{"box": [1, 2, 3, 4], "score": 0.5}]}
INDEX = [{"version": 1, "width": 64, "height": 48, "fps": 5}, {"t": 1.5, "file": "000001.jpg", "looks": [LOOK]}]


@pytest.fixture(name="folder")
def _folder(tmp_path):
    return tmp_path / "runs"


def _run(folder, name, summary=None, *, pictures=False):
    """A run folder."""
    path = folder / name
    path.mkdir(parents=True)
    (path / "journal.jsonl").write_text("".join(f"{each.to_json()}\n" for each in JOURNAL), encoding="utf-8")
    os.utime(path / "journal.jsonl", (WRITTEN_S, WRITTEN_S))
    if summary is not None:
        text = summary if isinstance(summary, str) else json.dumps(summary)
        (path / "summary.json").write_text(text, encoding="utf-8")
    if pictures:
        (path / "camera").mkdir()
        (path / "camera" / "index.jsonl").write_text("\n".join(map(json.dumps, INDEX)), encoding="utf-8")
        (path / "camera" / "000001.jpg").write_bytes(b"\xff\xd8\xff a picture")
    return path


def _client(folder):
    return client_of(server_of(folder.parent))


def test_the_list_has_result_length_and_targets(folder):
    _run(folder, "x-001", {**SUMMARY, "targets": [{"target": "lena", "outcome": "reached", "searches": 1}]})
    (line,) = Runs(folder).listed()
    target = {"target": "lena", "outcome": "reached"}
    assert line == {"name": "x-001", "map": False, **SUMMARY, "targets": [target]}


def test_a_run_of_another_program_is_running_while_its_journal_grows(folder):
    _run(folder, "x-001")
    later_s = [0.0, 9.0, 11.0, -3600.0]  # the clock was put back after the last
    lists = [Runs(folder, lambda s=s: WRITTEN_S + s).listed() for s in later_s]
    assert [line["ending"] for (line,) in lists] == ["running", "running", "unfinished", "unfinished"]


@pytest.mark.parametrize(
    "summary",
    [
        None,
        "",
        "[]",
        "{",
        "[" * 100_000,
        {},
        {**SUMMARY, "ending": 5},
        {**SUMMARY, "duration_s": "long"},
        {**SUMMARY, "duration_s": "nan"},
        '{"ending":"achieved","achieved":true,"duration_s":NaN}',
        {**SUMMARY, "targets": "all"},
        {**SUMMARY, "targets": [None]},
    ],
    ids=range(12),
)
def test_a_run_without_a_summary_that_can_be_read_is_listed_by_its_journal(folder, summary):
    _run(folder, "x-001", summary)
    (line,) = Runs(folder).listed()
    assert (line["mission"], line["ending"], line["duration_s"]) == ("<b>a mission</b>", "unfinished", 4.5)


@pytest.mark.parametrize("damage", ["empty", "folder", "binary", "gone"])
def test_a_run_that_cannot_be_read_is_listed_and_its_replay_says_why(folder, damage):
    journal = _run(folder, "x-001") / "journal.jsonl"
    journal.unlink()
    if damage == "folder":
        journal.mkdir()
    elif damage == "gone":
        journal.symlink_to(folder / "nowhere")
    else:
        journal.write_bytes(b"\xff\x00" * 9 if damage == "binary" else b"")
    _run(folder, "y-001", SUMMARY)
    assert {line["name"]: line["ending"] for line in Runs(folder).listed()}["y-001"] == "achieved"
    client = _client(folder)
    assert client.get("/api/runs").status_code == 200
    assert client.get("/api/runs/x-001").status_code in (404, 422)


@pytest.mark.skipif(os.name == "nt", reason="names there are text")
def test_a_name_that_is_not_a_text_is_left_out(folder):
    _run(folder, "x-001")
    os.rename(folder / "x-001", os.fsencode(folder) + b"/\xff")
    assert _client(folder).get("/api/runs").json() == []


def test_a_replay_has_pictures_with_their_boxes(folder):
    _run(folder, "a b#1", pictures=True)
    client = _client(folder)
    (picture,) = client.get("/api/runs/a%20b%231").json()["pictures"]
    assert (picture["t"], picture["looks"][0]["found"][0]["box"]) == (1.5, [1, 2, 3, 4])
    assert client.get(picture["src"]).content == b"\xff\xd8\xff a picture"


def test_a_replay_of_a_run_without_pictures_has_none(folder):
    _run(folder, "x-001")
    assert Runs(folder).replay("x-001")["pictures"] == []


def test_text_that_is_not_unicode_does_not_break_the_replay(folder):
    journal = _run(folder, "x-001") / "journal.jsonl"
    journal.write_text('{"t":0,"kind":"start","state":"idle","target":"\\ud800"}\n', encoding="utf-8")
    assert _client(folder).get("/api/runs/x-001").json()["records"][0]["target"] == "\ud800"


@pytest.mark.parametrize(
    "path",
    [
        "/runs/x-001/mission.json",
        "/runs/x-001/camera/index.jsonl",
        "/runs/x-001/camera/000002.jpg",
        "/runs/x-001/camera/..%2fsummary.json",
        "/runs/x-001/camera/%2e%2e/%2e%2e/secret.jpg",
        "/runs/x-001/..%2f..%2fsecret.jpg",
        "/runs/%2e%2e/secret.jpg",
        "/runs/..%2fruns%2fx-001/summary.json",
        "/runs/x-001//etc/passwd",
        "/runs/x-001/camera/000001.jpg%00",
        "/api/runs/%2e%2e",
        "/api/runs/%00",
    ],
)
def test_nothing_else_is_given(folder, path):
    _run(folder, "x-001", SUMMARY, pictures=True)
    (folder.parent / "secret.jpg").touch()
    (folder.parent / "journal.jsonl").write_text(JOURNAL[0].to_json(), encoding="utf-8")
    assert _client(folder).get(path).status_code == 404


def test_an_unknown_run_is_a_key_error_and_a_damaged_one_a_config_error(folder):
    _run(folder, "x-001")
    (folder / "x-001" / "journal.jsonl").write_text("", encoding="utf-8")
    with pytest.raises(ConfigError):
        Runs(folder).replay("x-001")
    with pytest.raises(KeyError):
        Runs(folder).replay("y-001")


WRONG = """
from behaviors.profiles.adaptive import AdaptiveProfile

class Wrong(AdaptiveProfile):
    @classmethod
    def own_policy(cls, mission): return Policy()

class Policy:
    def select(self, evidence): return None
    def candidates(self, evidence): return None
"""


def test_the_replay_of_a_run_whose_profile_returns_something_else_says_so(folder, monkeypatch):
    path = _run(folder, "x-001")
    (folder / "wrong.py").write_text(WRONG, encoding="utf-8")
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(registry, "external_profiles", {})
    mission = with_profile(read_mission_file(None), "wrong:Wrong")
    (path / "mission.json").write_text(mission.model_dump_json(), encoding="utf-8")
    here = {"travel_s": 0.0, "scan_s": 8.0, "chance": 0.5}
    evidence = {"reason": "never_seen", "seen_since_search": False, "researches": 1, "here": here}
    choice = Record(5.0, RecordKind.CHOICE, "select", "lena", {"choice": "wait", "why": "", "evidence": evidence})
    with (path / "journal.jsonl").open("a", encoding="utf-8") as journal:
        journal.write(choice.to_json())
    answer = _client(folder).get("/api/runs/x-001")
    assert answer.status_code == 422
    assert "candidates() of wrong:Policy" in answer.text


@pytest.mark.parametrize("change", ["grown", "cut", "gone"])
def test_a_file_that_changes_between_the_question_for_its_size_and_its_reading_is_sent_as_it_is_then(
    folder, monkeypatch, change
):
    journal = _run(folder, "x-001") / "journal.jsonl"
    content, stat = journal.read_bytes(), os.stat

    def changing(path, *args, **keys):
        if os.fspath(path) != str(journal):
            return stat(path, *args, **keys)
        journal.write_bytes(content)
        found = stat(path, *args, **keys)
        if change == "gone":
            journal.unlink()
        else:
            journal.write_bytes(2 * content if change == "grown" else b"")
        return found

    client = _client(folder)
    with monkeypatch.context() as during:
        during.setattr(os, "stat", changing)
        answer = client.get("/runs/x-001/journal.jsonl")
    if change == "gone":
        assert answer.status_code == 404
    else:
        assert answer.status_code == 200
        assert len(answer.content) == int(answer.headers["content-length"])


def test_a_file_that_is_too_large_to_be_sent_is_not_said_to_be_missing(folder, monkeypatch):
    _run(folder, "x-001")
    monkeypatch.setattr(app, "MAX_BYTES", 10)
    assert "too large" in _client(folder).get("/runs/x-001/journal.jsonl").text
