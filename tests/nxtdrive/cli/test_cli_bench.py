"""``nxtdrive bench``: prints figures, compares where both programs have one, and keeps them as JSON."""

import json

import pytest

from nxtdrive.cli.main import DONE, main
from nxtdrive.tools.dev import bench
from nxtdrive.tools.dev.bench import Figure

FIGURES = [
    Figure("requests", 1.5, "µs", peer=6.0),
    Figure("ratio", 0.25, "x", "<= 0.5", True),
    Figure("unknown", float("nan"), "s"),
]


@pytest.fixture
def measured(monkeypatch):
    """The areas measured, in order; each gives the same figures."""
    areas = []

    def measure(area, address=None):
        areas.append(area)
        return FIGURES

    monkeypatch.setattr(bench, "measure", measure)
    return areas


def test_the_areas_of_the_driver_end_with_both_programs_side_by_side(measured, tmp_path, capsys):
    out = tmp_path / "figures.json"
    assert main(["bench", "driver", "--out", str(out)]) == DONE
    assert measured == list(bench.DRIVER_AREAS)
    table = capsys.readouterr().out.partition("measured in this run")[2]
    assert [word for word in table.splitlines()[2].split() if word.isascii()] == ["requests", "1.5", "6"]
    assert "ratio" not in table
    told = json.loads(out.read_text(encoding="utf-8"))
    assert told["figures"][0] == {
        "name": "requests",
        "value": 1.5,
        "unit": "µs",
        "goal": "",
        "met": None,
        "peer": 6.0,
    }
    assert told["figures"][2]["value"] is None, "JSON has no NaN"
    assert told["before"]["cores"] == told["after"]["cores"] >= 1


def test_json_is_all_that_is_printed(measured, answered):
    assert len(answered("bench", "protocol")["figures"]) == len(FIGURES)


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["motors"], "Choose from"),
        (["driver", "--nxt", "usb://"], "on a real brick"),
        (["--out", "/nowhere/x"], "--out"),
    ],
)
def test_mistakes_are_reported_before_anything_is_measured(words, hint, measured, refused):
    assert hint in refused("bench", *words)
    assert measured == []


def test_the_help_names_every_area(printed):
    told = printed("bench", "--help")
    assert [area for area in (*bench.AREAS, bench.DRIVER) if area not in told] == []


def test_nothing_is_compared_when_nxt_python_is_not_installed(monkeypatch):
    monkeypatch.setattr(bench, "run_nxt_python", lambda *words: None)
    monkeypatch.setattr(bench, "REPEATS", 1)
    figures = list(bench.measure_protocol())
    assert all(figure.peer is None for figure in figures)
    assert not any("nxt-python" in figure.name for figure in figures)
