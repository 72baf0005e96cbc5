"""The styles of a run's map: distinguished by colour, and in grey by shape, width and dashes."""

from __future__ import annotations

from dataclasses import dataclass

from behaviors.recoveries import recovery_in
from nxtdrive.drawing.sheet import INK, Color
from nxtdrive.recording.map.events import MapEvent

UNKNOWN: Color = (236, 236, 233)
HINT: Color = (196, 199, 203)
SOLID: Color = (96, 101, 109)
ECHO: Color = (172, 174, 178)
VIEW: Color = (250, 240, 200)
VIEW_EDGE: Color = (205, 185, 120)
ROOM: Color = (150, 150, 150)
SEARCH: Color = (30, 110, 190)
ARRIVE: Color = (0, 145, 105)
FAILED: Color = (200, 30, 40)
TARGET_COLORS: tuple[Color, ...] = ((175, 35, 95), (120, 85, 0), (60, 60, 160), (20, 100, 110))


@dataclass(frozen=True, slots=True)
class LineStyle:
    """How a line is drawn.

    Attributes:
        text: What it means.
        color: Red, green, blue.
        width: Pixels.
        dash: Lengths of strokes and gaps in turn, pixels; none for a solid line.
    """

    text: str
    color: Color
    width: float
    dash: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class MarkStyle:
    """How an event is marked; attributes as in `LineStyle`, and one of `nxtdrive.drawing.sheet.MARKERS`."""

    text: str
    color: Color
    marker: str


PATHS = {
    "search": LineStyle("path: search", SEARCH, 1.8),
    "arrive": LineStyle("path: drive to a target", ARRIVE, 4.5),
    "retreat": LineStyle("path: back off", FAILED, 2.5, (2, 3)),
}
"""The path in each state that is not a recovery."""
OTHER_PATH = LineStyle("path: other", INK, 1.2)
TRUE_ROOM = LineStyle("true room (simulated)", ROOM, 3.5)
MOVED = LineStyle("moved or new in it at the end", ROOM, 3.5, (7, 5))
MARKS = {
    "failed": MarkStyle("failed", FAILED, "tilted_cross"),
    "reached": MarkStyle("target reached", ARRIVE, "star"),
    "seen": MarkStyle("target seen, drive to it", ARRIVE, "circle"),
    "retreat": MarkStyle("held or touched, backs off", FAILED, "circle"),
    "outage": MarkStyle("outage", FAILED, "tilted_cross"),
}
"""The mark of each kind of event."""
OTHER_MARK = MarkStyle("other event", INK, "circle")


def path_style(state: str) -> LineStyle:
    """Return how the path in a state is drawn."""
    recovery = recovery_in(state)
    if recovery:
        return LineStyle(f"path: {recovery.label}", recovery.color, 3.5, recovery.dash)
    return PATHS.get("arrive" if state == "verify" else state, OTHER_PATH)


def mark_style(event: MapEvent) -> MarkStyle:
    """Return how an event is marked."""
    if event.recovery:
        return MarkStyle(f"failed, then: {event.recovery.label}", event.recovery.color, event.recovery.marker)
    return MARKS.get(event.kind, OTHER_MARK)


def target_color(number: int) -> Color:
    """Return the colour of a target, by its number from 0."""
    return TARGET_COLORS[number % len(TARGET_COLORS)]


def lightened(color: Color) -> Color:
    """Return a colour mixed with white."""
    red, green, blue = ((part + 2 * 255) // 3 for part in color)
    return red, green, blue
