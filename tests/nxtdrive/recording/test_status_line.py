"""The live line on the terminal."""

from __future__ import annotations

import io

from rich.console import Console

from behaviors.journal import Kind, Record
from nxtdrive.recording.status_line import StatusLine

SIGHTING = {"bearing_deg": -12.0, "distance_mm": 1234.0, "confidence": 1.0, "box": [0, 0, 1, 1]}


def test_it_shows_state_target_sighting_time_and_battery():
    screen = io.StringIO()
    with StatusLine(Console(file=screen, force_terminal=True, width=100)) as line:
        line(Record(3.0, Kind.CALL, "arrive", "lena", {"verb": "arrive", "battery_mv": 7754}))
        line(Record(12.5, Kind.LOOK, "arrive", "lena", {"sighting": SIGHTING}))
    shown = screen.getvalue()
    for part in ("arrive", "lena", "1234 mm at -12°", "12.5 s", "battery 7.8 V"):
        assert part in shown


def test_it_is_silent_where_there_is_no_terminal():
    screen = io.StringIO()
    with StatusLine(Console(file=screen, force_terminal=False)) as line:
        line(Record(12.5, Kind.LOOK, "arrive", "lena", {"sighting": SIGHTING}))
    assert screen.getvalue() == ""
