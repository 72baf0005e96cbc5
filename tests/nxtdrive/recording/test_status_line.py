"""The live line on the terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from behaviors.journal import Record, RecordKind
from nxtdrive.recording.status_line import StatusLine

SIGHTING = {"bearing_deg": -12.0, "distance_mm": 1234.0, "confidence": 1.0, "box": [0, 0, 1, 1]}


def test_it_shows_state_target_sighting_time_and_battery():
    screen = io.StringIO()
    with StatusLine(Console(file=screen, force_terminal=True, width=100)) as line:
        line(Record(3.0, RecordKind.CALL, "arrive", "lena", {"verb": "arrive", "battery_mv": 7754}))
        line(Record(12.5, RecordKind.LOOK, "arrive", "lena", {"sighting": SIGHTING}))
    shown = screen.getvalue()
    for part in ("arrive", "lena", "1234 mm at -12°", "12.5 s", "battery 7.8 V"):
        assert part in shown


def test_it_is_silent_where_there_is_no_terminal():
    screen = io.StringIO()
    with StatusLine(Console(file=screen, force_terminal=False)) as line:
        line(Record(12.5, RecordKind.LOOK, "arrive", "lena", {"sighting": SIGHTING}))
    assert screen.getvalue() == ""


def _shown(*records: Record) -> str:
    screen = io.StringIO()
    with StatusLine(Console(file=screen, force_terminal=True, width=120)) as line:
        for record in records:
            line(record)
    return screen.getvalue()


@pytest.mark.parametrize(("bearing_deg", "shown"), [(-0.3, "at +0°"), (0.4, "at +0°"), (-0.6, "at -1°")])
def test_a_bearing_that_rounds_to_zero_has_no_minus(bearing_deg, shown):
    assert shown in _shown(
        Record(1.0, RecordKind.LOOK, "arrive", "lena", {"sighting": SIGHTING | {"bearing_deg": bearing_deg}})
    )


def test_a_recovery_is_named_in_words_and_says_why_it_was_chosen():
    choice = Record(3.0, RecordKind.CHOICE, "select", "lena", {"choice": "detour", "why": "waiting does not pay"})
    shown = _shown(choice, Record(3.0, RecordKind.TRANSITION, "detour", "lena", {"source": "select", "to": "detour"}))
    assert "go round" in shown
    assert "waiting does not pay" in shown
    later = Record(9.0, RecordKind.LOOK, "arrive", "lena", {"sighting": SIGHTING})
    assert "waiting does not pay" not in _shown(choice, later).rpartition("arrive")[2]


@pytest.mark.parametrize(("part", "says"), [("link", "brick"), ("camera", "camera"), ("sensor", "sensor")])
def test_a_suspended_mission_says_what_it_waits_for_and_how_long(part, says):
    shown = _shown(Record(3.0, RecordKind.OUTAGE, "suspended", "lena", {"part": part, "left_s": 42.5}))
    assert says in shown
    assert "waiting for 42 s more" in shown
