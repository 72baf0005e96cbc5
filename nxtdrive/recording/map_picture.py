"""Draws ``map.png`` from the journal alone: where the robot believes it was, what it saw and what it decided.

Everything is in the frame of the robot's start and as the robot measured it: the path by odometry, walls where the
ultrasonic sensor received an echo, targets where the camera located them. The simulation's truth is not used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from behaviors.journal import Kind, Record
from behaviors.ports import Point
from behaviors.recoveries import recovery_in

Image = npt.NDArray[np.uint8]
Color = tuple[int, int, int]

SCALE = 0.2
"""Pixels per millimetre."""

MARGIN_PX = 60
LEGEND_PX = 250
SMALLEST_MM = 2600.0
"""A map shows at least this much in each direction."""

INK: Color = (60, 50, 45)
PAPER: Color = (250, 250, 248)
GRID: Color = (228, 228, 224)
ECHO: Color = (150, 140, 130)

SEARCH: Color = (200, 130, 30)
ARRIVE: Color = (70, 160, 40)
FAILED: Color = (40, 40, 200)
STATE_COLORS: dict[str, Color] = {"search": SEARCH, "arrive": ARRIVE}
"""Colour of the path in each state that is no recovery, blue-green-red; recoveries have theirs in the registry."""

TARGET_COLORS: tuple[Color, ...] = ((60, 60, 210), (30, 110, 190), (150, 120, 20), (120, 40, 120))


@dataclass(slots=True)
class Mark:
    """A place where something was decided.

    Attributes:
        where: The place.
        text: What, for the legend.
        color: Blue, green, red.
        marker: End of the name of one of OpenCV's markers, in lower case.
    """

    where: Point
    text: str
    color: Color
    marker: str

    def draw(self, image: Image, place: tuple[int, int], size: int) -> None:
        """Draw it at a pixel."""
        shape = getattr(cv2, f"MARKER_{self.marker.upper()}")
        cv2.drawMarker(image, place, self.color, shape, size, 2, cv2.LINE_AA)


@dataclass(slots=True)
class MapData:
    """What a journal has for the map."""

    path: list[tuple[Point, str]] = field(default_factory=list)
    echoes: list[Point] = field(default_factory=list)
    sightings: dict[str, list[Point]] = field(default_factory=dict)
    looks: list[tuple[Point, float]] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)

    def points(self) -> list[Point]:
        """Return every point that must be on the map."""
        seen = [point for points in self.sightings.values() for point in points]
        return [(0.0, 0.0), *(point for point, _ in self.path), *self.echoes, *seen]


def draw_map(records: Sequence[Record]) -> Image:
    """Draw the map of a run.

    Args:
        records: The whole journal.

    Returns:
        Shape (height, width, 3), dtype uint8, BGR.
    """
    known = gather(records)
    sheet = _Sheet(known.points())
    sheet.grid()
    for echo in known.echoes:
        cv2.circle(sheet.image, sheet.at(echo), 2, ECHO, -1, cv2.LINE_AA)
    for (start, _), (end, state) in zip(known.path, known.path[1:], strict=False):
        cv2.line(sheet.image, sheet.at(start), sheet.at(end), state_color(state), 3, cv2.LINE_AA)
    for where, heading_deg in known.looks:
        _tick(sheet, where, heading_deg)
    for i, (target, points) in enumerate(known.sightings.items()):
        color = TARGET_COLORS[i % len(TARGET_COLORS)]
        for point in points:
            cv2.circle(sheet.image, sheet.at(point), 4, color, -1, cv2.LINE_AA)
        sheet.text(target, points[-1], color, 0.5, shift=(9, -9))
    cv2.arrowedLine(sheet.image, sheet.at((0.0, 0.0)), sheet.at((160.0, 0.0)), INK, 2, cv2.LINE_AA, tipLength=0.4)
    sheet.text("start", (0.0, 0.0), INK, 0.42, shift=(10, 18))
    _draw_marks(sheet, known.marks)
    _legend(sheet, known, records)
    return sheet.image


def state_color(state: str) -> Color:
    """Return the colour of the path in a state."""
    recovery = recovery_in(state)
    return recovery.color if recovery else STATE_COLORS.get(state, INK)


def gather(records: Sequence[Record]) -> MapData:
    """Extract from a journal what the map shows."""
    known = MapData()
    here: Point = (0.0, 0.0)
    for record in records:
        pose = record.data.get("pose")
        if isinstance(pose, list):
            x_mm, y_mm, heading_deg = (float(value) for value in pose if isinstance(value, int | float))
            here = (x_mm, y_mm)
            known.path.append((here, record.state))
            if record.kind is Kind.LOOK:
                if record.state == "search":
                    known.looks.append((here, heading_deg))
                _add_look(known, record, here, heading_deg)
        if record.kind is Kind.TRANSITION:
            mark = _mark_of(record, here)
            if mark:
                known.marks.append(mark)
    return known


def _add_look(known: MapData, record: Record, here: Point, heading_deg: float) -> None:
    range_mm, sighting = record.data.get("range_mm"), record.data.get("sighting")
    if isinstance(range_mm, int | float):
        known.echoes.append(_ahead(here, heading_deg, float(range_mm)))
    if isinstance(sighting, dict):
        distance_mm, bearing_deg = sighting["distance_mm"], sighting["bearing_deg"]
        if isinstance(distance_mm, int | float) and isinstance(bearing_deg, int | float):
            place = _ahead(here, heading_deg + float(bearing_deg), float(distance_mm))
            known.sightings.setdefault(record.target, []).append(place)


def _mark_of(record: Record, here: Point) -> Mark | None:
    """Return the mark that a transition leaves on the map."""
    entered = str(record.data["to"])
    if entered == "select":
        reason = str(record.data.get("reason", "")).replace("_", " ")
        return Mark(here, f"{record.target}: {reason}", FAILED, "tilted_cross")
    if entered == "reached":
        return Mark(here, f"{record.target}: reached", ARRIVE, "star")
    recovery = recovery_in(entered)
    return Mark(here, f"{record.target}: {recovery.label}", recovery.color, recovery.marker) if recovery else None


def _ahead(here: Point, heading_deg: float, distance_mm: float) -> Point:
    angle = math.radians(heading_deg)
    return here[0] + distance_mm * math.cos(angle), here[1] + distance_mm * math.sin(angle)


class _Sheet:
    """The image: maps millimetres of the robot's frame to pixels; x forward is up, y right is right."""

    def __init__(self, points: Sequence[Point]) -> None:
        xs, ys = [point[0] for point in points], [point[1] for point in points]
        self._x_mid, self._y_mid = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
        self.up_mm = max(SMALLEST_MM, max(xs) - min(xs))
        self.right_mm = max(SMALLEST_MM, max(ys) - min(ys))
        self.width = round(self.right_mm * SCALE) + 2 * MARGIN_PX
        self.height = round(self.up_mm * SCALE) + 2 * MARGIN_PX
        self.image: Image = np.full((self.height, self.width + LEGEND_PX, 3), PAPER, np.uint8)

    def at(self, point: Point) -> tuple[int, int]:
        """Return the pixel of a point."""
        return (
            round((point[1] - self._y_mid) * SCALE + self.width / 2),
            round(self.height / 2 - (point[0] - self._x_mid) * SCALE),
        )

    def grid(self, step_mm: float = 500.0) -> None:
        """Draw lines every half metre."""
        left_px, top_px = self.at((self._x_mid + self.up_mm / 2, self._y_mid - self.right_mm / 2))
        right_px, bottom_px = self.at((self._x_mid - self.up_mm / 2, self._y_mid + self.right_mm / 2))
        for i in range(-40, 41):
            column, row = self.at((i * step_mm, i * step_mm))
            if left_px <= column <= right_px:
                cv2.line(self.image, (column, top_px), (column, bottom_px), GRID, 1)
            if top_px <= row <= bottom_px:
                cv2.line(self.image, (left_px, row), (right_px, row), GRID, 1)

    def text(self, text: str, point: Point, color: Color, size: float, shift: tuple[int, int] = (0, 0)) -> None:
        """Write text beside a point, with a halo so that it can be read over lines."""
        column, row = self.at(point)
        write(self.image, text, (column + shift[0], row + shift[1]), color, size)


def write(image: Image, text: str, where: tuple[int, int], color: Color, size: float) -> None:
    """Write text with a halo in the colour of the background."""
    for ink, width in ((PAPER, 4), (color, 1)):
        cv2.putText(image, text, where, cv2.FONT_HERSHEY_SIMPLEX, size, ink, width, cv2.LINE_AA)


def _tick(sheet: _Sheet, where: Point, heading_deg: float) -> None:
    cv2.line(sheet.image, sheet.at(where), sheet.at(_ahead(where, heading_deg, 90.0)), (190, 180, 170), 1, cv2.LINE_AA)


def _draw_marks(sheet: _Sheet, marks: Sequence[Mark]) -> None:
    """Draw marks with their numbers in the order of events; marks at one place are drawn side by side."""
    taken: dict[tuple[int, int], int] = {}
    for number, mark in enumerate(marks, start=1):
        column, row = sheet.at(mark.where)
        cell = (column // 24, row // 24)
        shift = taken.get(cell, 0)
        taken[cell] = shift + 1
        place = (column + 26 * (shift % 4), row - 8 + 20 * (shift // 4))
        mark.draw(sheet.image, place, 14)
        write(sheet.image, str(number), (place[0] + 5, place[1] - 7), mark.color, 0.38)


def _legend(sheet: _Sheet, known: MapData, records: Sequence[Record]) -> None:
    left, row = sheet.width + 8, 34
    for state in dict.fromkeys(state for _, state in known.path if state_color(state) != INK):
        cv2.line(sheet.image, (left, row - 4), (left + 26, row - 4), state_color(state), 3, cv2.LINE_AA)
        write(sheet.image, state, (left + 36, row), INK, 0.42)
        row += 20
    cv2.circle(sheet.image, (left + 13, row - 4), 2, ECHO, -1, cv2.LINE_AA)
    write(sheet.image, "ultrasonic echo", (left + 36, row), INK, 0.42)
    row += 20
    cv2.line(sheet.image, (left, row - 4), (left + 100, row - 4), INK, 2)
    write(sheet.image, f"{100 / SCALE / 1000:.1f} m", (left + 108, row), INK, 0.42)
    row += 30
    for number, mark in enumerate(known.marks, start=1):
        if row > sheet.height - 40:
            write(sheet.image, "...", (left, row), INK, 0.38)
            break
        mark.draw(sheet.image, (left + 6, row - 4), 10)
        write(sheet.image, f"{number} {mark.text}", (left + 20, row), INK, 0.38)
        row += 17
    if records:
        write(sheet.image, f"{records[-1].time_s:.0f} s", (left, sheet.height - 16), INK, 0.42)
