"""The campaign of signals: a few of its trials, and proof that it finds violations."""

from __future__ import annotations

import json
import signal
import sys

import pytest

from nxtdrive.tools.dev.faults import signals
from nxtdrive.tools.dev.faults.signals import CASES, Ended, evaluate

RUN = CASES["run, sim://"]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")


@pytest.mark.parametrize("number", [3, 5])
def test_a_sample(number):
    tally = signals.CAMPAIGN.run(1, range(number, number + 1))
    assert tally.violations == []


@pytest.mark.nightly
def test_a_larger_sample():
    assert signals.CAMPAIGN.run(2, range(len(CASES))).violations == []


@pytest.mark.parametrize(
    ("ended", "found"),
    [
        (Ended(None, "", ""), "hangs"),
        (Ended(-6, "", ""), "exit code -6"),
        (Ended(0, "", ""), "exit code 0"),
        (Ended(1, "", "Traceback (most recent call last):"), "traceback"),
    ],
)
def test_what_must_not_be_is_found(ended, found, tmp_path):
    _, wrong = evaluate(RUN, signal.SIGTERM, ended, tmp_path)
    assert any(found in each for each in wrong)


def test_an_incomplete_folder_is_found(tmp_path):
    run = tmp_path / "runs" / "cat-001"
    run.mkdir(parents=True)
    ended = Ended(1, "", "")
    assert "map.png, mission.json, summary.json" in str(evaluate(RUN, signal.SIGHUP, ended, tmp_path))
    for name in ("map.png", "mission.json", "journal.jsonl"):
        (run / name).write_text("{}\n")
    (run / "summary.json").write_text(json.dumps({"ending": "broken", "error": "129"}))
    assert "not complete" in str(evaluate(RUN, signal.SIGHUP, ended, tmp_path))
