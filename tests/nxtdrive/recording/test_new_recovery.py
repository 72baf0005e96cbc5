"""A recovery that is added to the registry appears everywhere that recoveries are shown, and in the chart."""

from __future__ import annotations

import io

import numpy as np
import pytest
from rich.console import Console as Terminal
from statemachine import State, StateChart

from behaviors.chart import MissionChart
from behaviors.events import Reason
from behaviors.evidence import Evidence
from behaviors.journal import Record, RecordKind
from behaviors.recoveries import RECOVERIES, WAIT, Choice, Recovery
from nxtdrive.recording.decisions import decisions
from nxtdrive.recording.map.map_drawing import draw_map, map_page
from nxtdrive.recording.progress_lines import ProgressLines
from nxtdrive.recording.status_line import StatusLine

BACK_UP = Recovery(
    "back_up",
    label="drive back",
    describe=lambda _: "drive back a little",
    color=(11, 222, 133),
    marker="star",
)
EVIDENCE = Evidence("lena", Reason.BLOCKED_SHORT, seen_since_search=True, researches=0)
CHOICE = {"choice": BACK_UP.name, "why": "it is free there", "evidence": EVIDENCE.known()}
RECORDS = [
    Record(2.0, RecordKind.CHOICE, "select", "lena", CHOICE),
    Record(2.0, RecordKind.TRANSITION, "back_up", "lena", {"source": "select", "to": "back_up"}),
    Record(2.5, RecordKind.LOOK, "back_up", "lena", {"pose": [-50.0, 0.0, 0.0], "range_mm": None, "sighting": None}),
    Record(3.0, RecordKind.LOOK, "back_up", "lena", {"pose": [-400.0, 0.0, 0.0], "range_mm": None, "sighting": None}),
]


class SmallChart(StateChart):
    """One more state beside the mission's own, with the same guard."""

    select = State(initial=True)
    back_up = State(final=True)
    wait = State(final=True)
    go = select.to(wait, cond="chosen") | select.to(back_up, cond="chosen")
    chosen = MissionChart.chosen

    def __init__(self, choice: Choice) -> None:
        self.choice = choice
        super().__init__()


@pytest.fixture(autouse=True)
def _registered(monkeypatch):
    monkeypatch.setitem(RECOVERIES, BACK_UP.name, BACK_UP)


@pytest.mark.parametrize("recovery", [BACK_UP, WAIT])
def test_the_charts_guard_leads_to_its_state(recovery):
    chart = SmallChart(Choice(recovery, "test"))
    chart.send("go")
    assert [state.id for state in chart.configuration] == [recovery.name]


def test_the_progress_lines_say_it():
    lines: list[str] = []
    progress = ProgressLines(lines.append)
    failed = {"source": "arrive", "to": "select", "event": "arrive_failed", "reason": "blocked_short", "evidence": {}}
    for record in (RECORDS[0], Record(2.0, RecordKind.TRANSITION, "select", "lena", failed)):
        progress(record)
    assert lines[-1].endswith("drive back a little: it is free there")


def test_the_status_line_names_it_with_its_reason():
    screen = io.StringIO()
    with StatusLine(Terminal(file=screen, force_terminal=True, width=120)) as line:
        for record in RECORDS[:2]:
            line(record)
    assert "drive back" in screen.getvalue()
    assert "it is free there" in screen.getvalue()


def test_the_map_has_its_mark_and_its_colour():
    failed = {"source": "arrive", "to": "select", "event": "arrive_failed", "reason": "blocked_short", "evidence": {}}
    records = [RECORDS[0], Record(2.0, RecordKind.TRANSITION, "select", "lena", failed), *RECORDS[1:]]
    assert {"failed, then: drive back", "path: drive back"} <= {key.text for key in map_page(records).keys}
    drawn = np.asarray(draw_map(records))
    assert np.any(np.all(drawn == np.array(BACK_UP.color, np.uint8), axis=2))


def test_an_explanation_puts_it_into_words():
    (decision,) = decisions(RECORDS)
    assert decision.choice is not None
    assert decision.choice.words() == "drive back a little"
