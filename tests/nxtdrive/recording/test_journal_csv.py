"""A journal as a table, read back by the standard library and by pandas."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from behaviors.journal import Record, RecordKind
from nxtdrive.cli.main import DONE, main
from nxtdrive.recording.journal_csv import COLUMNS, journal_csv

SIGHTING = {"bearing_deg": -3.5, "distance_mm": 900.0, "confidence": 1.0, "box": [10, 10, 20, 20]}
RECORDS = [
    Record(0.0, RecordKind.START, "idle", "lena", {"format": 3, "mission": "m", "targets": ["lena"]}),
    Record(0.574, RecordKind.LOOK, "search", "lena", {"pose": [0.0, 1.5, 90.0], "range_mm": 1500, "sighting": None}),
    Record(1.0, RecordKind.LOOK, "search", "lena", {"pose": [5, 0, 0], "range_mm": None, "sighting": SIGHTING}),
    Record(
        1.5,
        RecordKind.STEP,
        "arrive",
        "lena",
        {"what": "advance", "stop": "done", "distance_mm": 250, "pose": [1, 2, 3]},
    ),
    Record(
        2.0, RecordKind.CHOICE, "search", "lena", {"choice": "wait", "why": "it moves", "wait_s": 4, "operator": True}
    ),
    Record(3.3, RecordKind.END, "finished", "lena", {"ending": "achieved", "targets": [], "error": ""}),
]


def _rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


def test_each_record_is_a_row_with_a_unit_in_each_column():
    rows = _rows(journal_csv(RECORDS))
    assert [float(row["t_s"]) for row in rows] == [record.time_s for record in RECORDS]
    _, look, seen, step, choice, end = rows
    assert (look["x_mm"], look["y_mm"], look["heading_deg"], look["range_mm"]) == ("0.0", "1.5", "90.0", "1500")
    assert (look["sighting_distance_mm"], seen["range_mm"]) == ("", "")
    assert (seen["sighting_bearing_deg"], seen["sighting_distance_mm"]) == ("-3.5", "900.0")
    assert json.loads(seen["more"]) == {"sighting": {"box": [10, 10, 20, 20]}}
    assert (step["what"], step["stop"], step["step_mm"]) == ("advance", "done", "250")
    assert (choice["choice"], choice["why"]) == ("wait", "it moves")
    assert (end["ending"], end["more"]) == ("achieved", '{"targets": [], "error": ""}')


def test_nothing_of_a_record_is_left_out():
    words = {"source": "search", "to": "select", "event": "target_lost", "reason": "out_of_sight"}
    numbers = {"turned_deg": -30.0, "battery_mv": 7412}
    records = [*RECORDS, Record(2.5, RecordKind.TRANSITION, "search", "lena", {**words, **numbers})]
    columns = {"pose": "x_mm", "distance_mm": "step_mm"}
    for record, row in zip(records, _rows(journal_csv(records)), strict=True):
        more = json.loads(row["more"] or "{}")
        for key, value in record.data.items():
            assert value is None or key in more or row[columns.get(key, key)], f"{key} of {record.kind}"


@pytest.mark.parametrize(
    "data",
    [
        {"pose": [1, 2]},
        {"pose": ["a", "b", "c"]},
        {"pose": {"x": 1}},
        {"sighting": 7},
        {"sighting": {"distance_mm": "far"}},
        {"distance_mm": [1]},
        {"reason": {"why": 1}},
        {"range_mm": True},
    ],
    ids=str,
)
def test_values_of_another_type_are_kept_as_they_are(data):
    (row,) = _rows(journal_csv([Record(0.0, RecordKind.LOOK, "search", "lena", data)]))
    assert json.loads(row["more"]) == data


def test_no_text_is_a_formula_to_a_spreadsheet():
    (row,) = _rows(
        journal_csv([Record(0.0, RecordKind.CHOICE, "search", '=HYPERLINK("x")', {"why": "+1", "choice": "-"})])
    )
    assert (row["target"], row["why"], row["choice"]) == ('\'=HYPERLINK("x")', "'+1", "'-")


def test_one_row_is_called_one_row(tmp_path, printed):
    (tmp_path / "journal.jsonl").write_text(f"{RECORDS[0].to_json()}\n", encoding="utf-8")
    assert re.search(r"journal\.csv: 0\.[1-9] kB, 1 row\n$", printed("export", tmp_path, "--csv"))


@pytest.mark.slow
def test_the_documented_lines_read_all_runs_by_pandas(here, printed):
    for number in (1, 2):
        folder = here / "runs" / f"lena-then-rilakkuma-{number:03d}"
        folder.mkdir(parents=True)
        text = "".join(f"{record.to_json()}\n" for record in RECORDS)
        (folder / "journal.jsonl").write_text(text, encoding="utf-8")
    assert "6 rows" in printed("export", "runs/lena-then-rilakkuma-001", "--csv")
    document = (Path(__file__).parents[3] / "docs" / "journal.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", document, flags=re.DOTALL)
    names: dict = {}
    exec(program, names)
    table, runs = names["table"], names["runs"]
    assert table["x_mm"].dropna().tolist() == [0.0, 5.0, 1.0]
    assert set(table.columns) == set(COLUMNS)
    assert sorted(set(runs.index.get_level_values(0))) == ["lena-then-rilakkuma-001", "lena-then-rilakkuma-002"]
    assert runs["t"].max() == 3.3


def test_text_that_is_not_unicode_makes_a_table_too(tmp_path):
    record = '{"t": 0, "kind": "start", "state": "idle", "target": "a\\ud800", "mission": "m"}\n'
    (tmp_path / "journal.jsonl").write_text(record, encoding="utf-8")
    assert main(["export", str(tmp_path), "--csv"]) == DONE
    (row,) = _rows((tmp_path / "journal.csv").read_text(encoding="utf-8"))
    assert row["target"] == "a?"


@pytest.mark.parametrize(("option", "name"), [("--csv", "journal.jsonl"), ("--html", "mission.json")])
def test_an_export_never_replaces_what_makes_the_run(tmp_path, refused, option, name):
    for file in ("journal.jsonl", "mission.json"):
        (tmp_path / file).write_text("".join(f"{record.to_json()}\n" for record in RECORDS), encoding="utf-8")
    before = (tmp_path / name).read_bytes()
    assert "the command reads it" in refused("export", tmp_path, option, tmp_path / name)
    assert (tmp_path / name).read_bytes() == before
