"""Paint the map of a run, with a legend of exactly what was painted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from behaviors.adaptive import grid_tuning
from behaviors.adaptive.grid_cells import CELL_MM
from behaviors.mission.robot import CameraTable
from behaviors.ports import Point, Pose
from nxtdrive.drawing.floor_view import Area, FloorView
from nxtdrive.drawing.legend import Key, Paint, dot_sample, line_sample, marker_sample, patch_sample, ring_sample
from nxtdrive.drawing.sheet import DIM, INK, PAPER, Color, Sheet
from nxtdrive.recording.map.events import MapEvent, Numbering
from nxtdrive.recording.map.scene import Line, MapScene, target_place
from nxtdrive.recording.map.style import (
    ECHO,
    HINT,
    MOVED,
    SOLID,
    TRUE_ROOM,
    UNKNOWN,
    VIEW,
    VIEW_EDGE,
    lightened,
    mark_style,
    path_style,
    target_color,
)

VIEW_MM = 520.0
"""How far the view of the camera is drawn."""
ARROW_PX = 95.0
"""An arrowhead shows the direction of the path after each such stretch."""
VISIBLE_MM = 60.0
"""Shorter pieces of a path cannot be seen: a state that has no longer one is not in the legend."""
MARK_PX, SMALL_MARK_PX = 6.5, 3.5
"""Marks of events with and without a number."""


def on_page(point: Point) -> Point:
    """Return a point as it lies on the page: to the right and downwards, with x forward up the page."""
    return point[1], -point[0]


class MapPainter:
    """The map of one run.

    Args:
        scene: What it shows.
        shown: Which events have numbers.
        camera: The camera as the mission describes it.
        room: The true room at the start, if it is simulated.
        new: What else stood in it at the end.
    """

    def __init__(
        self, scene: MapScene, shown: Numbering, camera: CameraTable, room: Sequence[Line], new: Sequence[Line]
    ) -> None:
        self._scene, self._camera = scene, camera
        self._walls = ((TRUE_ROOM, room), (MOVED, new))
        self._numbered = [group.first for group in shown.numbered]
        self._targets = [
            (target, target_color(i), points) for i, (target, points) in enumerate(scene.sightings.items())
        ]
        self._cells: tuple[tuple[str, Color, list[Point]], ...] = (
            ("free floor, by the sonar", PAPER, scene.cells(-math.inf, -grid_tuning.KNOWN)),
            ("perhaps an obstacle", HINT, scene.cells(grid_tuning.HINT, grid_tuning.SOLID)),
            ("obstacle, by the sonar", SOLID, scene.cells(grid_tuning.SOLID)),
        )

    def paint(self, view: FloorView) -> None:
        """Paint it."""
        sheet, (free, *occupied) = view.sheet, self._cells
        sheet.box(view.frame, UNKNOWN)
        _paint_cells(view, *free[1:])
        view.draw_grid()
        for event in self._failed():
            _paint_view(view, self._camera.view_at(event.pose), self._camera.hfov_deg / 2)
        for _, color, cells in occupied:
            _paint_cells(view, color, cells)
        for style, lines in self._walls:
            for x0, y0, x1, y1 in lines:
                sheet.line(_pixels(view, [(x0, y0), (x1, y1)]), style.color, style.width, style.dash)
        for at in _pixels(view, self._scene.echoes):
            sheet.circle(at, 1.5, ECHO)
        for _, color, points in self._targets:
            for at in _pixels(view, points):
                sheet.circle(at, 2.2, lightened(color))
            _paint_target(sheet, view.at(on_page(target_place(points))), color)
        for state, points in self._scene.pieces():
            _paint_path(view, state, points)
        self._paint_robot(view)
        for events, size in ((self._scene.events, SMALL_MARK_PX), (self._numbered, MARK_PX)):
            for event in events:
                mark = mark_style(event)
                sheet.marker(mark.marker, view.at(on_page(event.pose.point)), size, mark.color)

    def keys(self, area: Area) -> Iterator[Key]:
        """Yield the legend for an area."""
        yield Key("start, and where the robot faced", lambda sheet, at: _paint_start(sheet, (at[0], at[1] + 4), 7.0))
        if len(self._scene.poses) > 1:
            yield Key("the robot at the end", ring_sample(10.0, INK, 1.5))
        yield from self._path_keys()
        marks = dict.fromkeys(mark_style(event) for event in self._scene.events)
        yield from (Key(style.text, marker_sample(style.marker, style.color)) for style in marks)
        yield from (Key(f"{target}, where the camera saw it", _sample(color)) for target, color, _ in self._targets)
        if self._failed():
            yield Key("view of the camera at a failure", patch_sample(VIEW, VIEW_EDGE))
        if self._scene.echoes:
            yield Key("echo of the sonar", dot_sample(2.5, ECHO))
        for text, color, cells in self._cells:
            if cells:
                yield Key(text, patch_sample(color, DIM))
        yield Key("not looked at", patch_sample(UNKNOWN, DIM))
        for style, lines in self._walls:
            if any(area.holds(on_page(end)) for x0, y0, x1, y1 in lines for end in ((x0, y0), (x1, y1))):
                yield Key(style.text, line_sample(style.color, style.width, style.dash))

    def _failed(self) -> list[MapEvent]:
        return [event for event in self._numbered if event.kind == "failed"]

    def _path_keys(self) -> Iterator[Key]:
        pieces = self._scene.pieces()
        visible = [state for state, points in pieces if math.dist(min(points), max(points)) >= VISIBLE_MM]
        for style in dict.fromkeys(map(path_style, visible)):
            yield Key(style.text, line_sample(style.color, style.width, style.dash))

    def _paint_robot(self, view: FloorView) -> None:
        """Draw the robot at its start and where it was last."""
        radius_mm = self._scene.floor.radius_mm
        radius = max(7.0, radius_mm * view.scale)
        _paint_start(view.sheet, view.at((0.0, 0.0)), radius)
        if len(self._scene.poses) > 1:
            last = self._scene.poses[-1][0]
            at, front = _pixels(view, [last.point, last.ahead(radius_mm)])
            view.sheet.circle(at, radius, None, INK, 1.5)
            view.sheet.line([at, front], INK, 1.5)


def _pixels(view: FloorView, points: Sequence[Point]) -> list[Point]:
    return [view.at(on_page(point)) for point in points]


def _paint_cells(view: FloorView, color: Color, cells: Sequence[Point]) -> None:
    half = CELL_MM * view.scale / 2
    for x, y in _pixels(view, cells):
        view.sheet.box((x - half, y - half, x + half, y + half), color)


def _paint_view(view: FloorView, pose: Pose, half_deg: float) -> None:
    arc = [pose.ahead(VIEW_MM, half_deg * i / 6) for i in range(-6, 7)]
    view.sheet.polygon(_pixels(view, [pose.point, *arc]), VIEW, VIEW_EDGE, 1.2)


def _paint_path(view: FloorView, state: str, points: Sequence[Point]) -> None:
    style = path_style(state)
    view.sheet.line(_pixels(view, points), style.color, style.width, style.dash)
    left_mm = ARROW_PX / view.scale / 2
    for start, end in pairwise(points):
        length_mm = math.dist(start, end)
        left_mm -= length_mm
        if left_mm <= 0:
            tip, along = view.at(on_page(end)), on_page((end[0] - start[0], end[1] - start[1]))
            tail = tip[0] - 12 * along[0] / length_mm, tip[1] - 12 * along[1] / length_mm
            view.sheet.arrow(tail, tip, style.color, 1.0, 13.0)
            left_mm = ARROW_PX / view.scale


def _paint_start(sheet: Sheet, at: Point, radius: float) -> None:
    sheet.circle(at, radius, PAPER, INK, 2.5)
    sheet.arrow(at, (at[0], at[1] - 1.9 * radius), INK, 2.5, radius * 0.7)


def _sample(color: Color) -> Paint:
    return lambda sheet, at: _paint_target(sheet, at, color)


def _paint_target(sheet: Sheet, at: Point, color: Color) -> None:
    sheet.circle(at, 10.0, PAPER, color, 3.0)
    sheet.circle(at, 4.5, color)
