"""Draw the true map of one run: the room, its objects, the robot's path, and its stops."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from PIL import Image

from behaviors.ports import Pose
from nxtdrive.drawing.blocks import Note, Tag
from nxtdrive.drawing.floor_view import Area, Axes, FloorView
from nxtdrive.drawing.legend import Key, line_sample, marker_sample, patch_sample, ring_sample
from nxtdrive.drawing.page import Page, draw_page
from nxtdrive.drawing.sheet import DIM, INK, Color, Sheet
from nxtdrive.recording.map_events import EventReader, MapEvent, Numbering, numbering
from nxtdrive.recording.map_picture import number_notes
from nxtdrive.recording.map_style import ARRIVE, FAILED, TARGET_COLORS, LineStyle, MarkStyle, mark_style
from sim_backend.judge import stop_counts
from sim_backend.scenarios.floor_plan import Goal, Obstacle, Point
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM

from .referee import EpisodeTrace, TruthSample

AXES = Axes("x, m", "y, m", up=False)
EDGE_MM = 150.0
"""Around the room."""
LOW_MM = 200.0
"""Objects lower than this hide no picture; they are drawn in outline."""
STANDING_SAMPLES = 10
"""A late object that stands still for this many samples is drawn."""
MARK_PX = 6.5

SOLID: Color = (190, 194, 200)
LATE: Color = (220, 140, 0)
PATHS = (
    LineStyle("path for the first target", (30, 110, 190), 3.0),
    LineStyle("path for the second target", (150, 60, 180), 3.0, (12, 6)),
    LineStyle("path for a further target", TARGET_COLORS[1], 3.0, (4, 4)),
)
OTHER = LineStyle("path for no target", INK, 1.2)
WRONG_STOP = MarkStyle("arrival that does not count", FAILED, "tilted_cross")
RIGHT_STOP = MarkStyle("arrival that counts", ARRIVE, "star")


def draw_true_map(trace: EpisodeTrace, title: str) -> Image.Image:
    """Draw the map of one mission; returns an RGB picture."""
    return draw_page(true_map_page(trace, title))


def true_map_page(trace: EpisodeTrace, title: str) -> Page:
    """Compose the map of one mission."""
    events = dict(_events(trace))
    shown = numbering(list(events))
    width_mm, depth_mm = trace.samples[0].scene.plan.size_mm
    goals = [goal for goal in trace.samples[-1].scene.goals.values() if goal.name in trace.targets]
    return Page(
        title=title,
        subtitle="; ".join(_result(trace)),
        area=Area(-EDGE_MM, -EDGE_MM, width_mm + EDGE_MM, depth_mm + EDGE_MM),
        axes=AXES,
        paint=lambda view: _paint(view, trace, events),
        keys=list(_keys(trace, events)),
        heading="What happened" if shown.numbered else "",
        notes=list(_notes(shown, events)),
        tags=[*(Tag(goal.at_mm, goal.name, ARRIVE, number=False) for goal in goals), *_tags(shown, events)],
        avoid=[sample.pose[:2] for sample in trace.samples[::3]],
        keep=[goal.at_mm for goal in goals],
    )


def _result(trace: EpisodeTrace) -> Iterator[str]:
    yield f"{trace.ending.replace('_', ' ')} after {trace.duration_s:.1f} s"
    yield f"contacts: {trace.samples[-1].contacts}"
    yield "all as it really was"


def _events(trace: EpisodeTrace) -> Iterator[tuple[MapEvent, MarkStyle]]:
    """Yield the events of a mission at their true places, and how they are marked."""
    reader = EventReader()
    for entry in trace.judged:
        x_mm, y_mm, heading_deg = entry.sample.pose
        event = reader.read(entry.record, Pose(x_mm, y_mm, heading_deg))
        if event and event.kind == "reached":
            counts = stop_counts(entry.sample.pose, entry.sample.scene, entry.record.target)
            yield event, RIGHT_STOP if counts else WRONG_STOP
        elif event:
            yield event, mark_style(event)


def _notes(shown: Numbering, events: dict[MapEvent, MarkStyle]) -> Iterator[Note]:
    return number_notes(shown, lambda event: events[event].color)


def _tags(shown: Numbering, events: dict[MapEvent, MarkStyle]) -> Iterator[Tag]:
    for number, group in enumerate(shown.numbered, start=1):
        yield Tag(_place(group.first), str(number), events[group.first].color)


def _place(event: MapEvent) -> Point:
    return event.pose.x_mm, event.pose.y_mm


def _paint(view: FloorView, trace: EpisodeTrace, events: dict[MapEvent, MarkStyle]) -> None:
    sheet, first = view.sheet, trace.samples[0]
    for obstacle in first.scene.plan.obstacles:
        _paint_obstacle(view, obstacle, None if obstacle.height_mm < LOW_MM else SOLID, DIM)
    for obstacle in _late_objects(trace):
        _paint_obstacle(view, obstacle, None, LATE)
    (left, top), (right, bottom) = view.all_at([(0.0, 0.0), first.scene.plan.size_mm])
    sheet.box((left, top, right, bottom), None, INK, 4.0)
    for goals in (first.scene.goals, trace.samples[-1].scene.goals):
        for goal in goals.values():
            _paint_picture(view, goal, ARRIVE if goal.name in trace.targets else DIM)
    for style, points in _pieces(trace):
        sheet.line(view.all_at(points), style.color, style.width, style.dash)
    for at in view.all_at([sample.pose[:2] for sample in _contacts(trace)]):
        sheet.circle(at, 9.0, None, FAILED, 2.5)
    x_mm, y_mm, heading_deg = first.pose
    _paint_start(sheet, view.at((x_mm, y_mm)), ROBOT_RADIUS_MM * view.scale, heading_deg)
    for event, mark in events.items():
        sheet.marker(mark.marker, view.at(_place(event)), MARK_PX, mark.color)


def _keys(trace: EpisodeTrace, events: dict[MapEvent, MarkStyle]) -> Iterator[Key]:
    """Yield the legend of exactly what occurs."""
    yield Key("start, and where the robot faced", lambda sheet, at: _paint_start(sheet, at, 8.0, 0.0))
    for style in dict.fromkeys(style for style, _ in _pieces(trace)):
        yield Key(style.text, line_sample(style.color, style.width, style.dash))
    for mark in dict.fromkeys(events.values()):
        yield Key(mark.text, marker_sample(mark.marker, mark.color))
    if any(_contacts(trace)):
        yield Key("touched something", ring_sample(9.0, FAILED, 2.5))
    first = trace.samples[0].scene
    yield Key("picture of a target, and where it faces", line_sample(ARRIVE, 5.0))
    if any(name not in trace.targets for name in first.goals):
        yield Key("another picture", line_sample(DIM, 5.0))
    low = [each.height_mm < LOW_MM for each in first.plan.obstacles if each.name not in first.goals]
    if not all(low):
        yield Key("obstacle", patch_sample(SOLID, DIM))
    if any(low):
        yield Key("obstacle that hides no picture", patch_sample((255, 255, 255), DIM))
    if _late_objects(trace):
        yield Key("came later, and stood there", patch_sample((255, 255, 255), LATE))


def _pieces(trace: EpisodeTrace) -> Iterator[tuple[LineStyle, Sequence[Point]]]:
    """Yield the path in pieces, one for each stretch for one target."""
    judged = iter(trace.judged)
    entry, target = next(judged, None), ""
    piece: list[Point] = []
    for sample in trace.samples:
        piece.append(sample.pose[:2])
        before = target
        while entry is not None and entry.sample.time_s <= sample.time_s:
            target, entry = entry.record.target, next(judged, None)
        if target != before:
            if len(piece) > 1:
                yield _path_style(trace, before), piece
            piece = [sample.pose[:2]]
    if len(piece) > 1:
        yield _path_style(trace, target), piece


def _path_style(trace: EpisodeTrace, target: str) -> LineStyle:
    if target not in trace.targets:
        return OTHER
    return PATHS[min(trace.targets.index(target), len(PATHS) - 1)]


def _contacts(trace: EpisodeTrace) -> list[TruthSample]:
    """Return the samples at which a new contact began."""
    pairs = zip(trace.samples, trace.samples[1:], strict=False)
    return [other for one, other in pairs if other.contacts > one.contacts]


def _late_objects(trace: EpisodeTrace) -> list[Obstacle]:
    """Return the late objects at every place where one stood still."""
    drawn, found = {id(trace.samples[0].scene)}, []
    for one, other in zip(trace.samples, trace.samples[STANDING_SAMPLES:], strict=False):
        if one.scene is other.scene and id(one.scene) not in drawn:
            drawn.add(id(one.scene))
            found += [each for each in one.scene.plan.obstacles if each.name in trace.late_objects]
    return found


def _paint_obstacle(view: FloorView, obstacle: Obstacle, fill: Color | None, outline: Color) -> None:
    (x, y), radius = obstacle.at_mm, obstacle.radius_mm
    if obstacle.size_mm == (0.0, 0.0):
        view.sheet.circle(view.at((x, y)), radius * view.scale, fill, outline, 2.0)
        return
    angle = math.radians(obstacle.facing_deg)
    along, across = (max(10.0, side + 2 * radius) / 2 for side in obstacle.size_mm)
    corners = [
        (
            x + i * along * math.cos(angle) - j * across * math.sin(angle),
            y + i * along * math.sin(angle) + j * across * math.cos(angle),
        )
        for i, j in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    view.sheet.polygon(view.all_at(corners), fill, outline, 2.0)


def _paint_picture(view: FloorView, goal: Goal, color: Color) -> None:
    (x, y), angle = goal.at_mm, math.radians(goal.facing_deg)
    across = (-math.sin(angle) * 80, math.cos(angle) * 80)
    view.sheet.line(view.all_at([(x - across[0], y - across[1]), (x + across[0], y + across[1])]), color, 5.0)
    at = view.at(goal.at_mm)
    view.sheet.arrow(at, (at[0] + 26 * math.cos(angle), at[1] + 26 * math.sin(angle)), color, 2.0, 11.0)


def _paint_start(sheet: Sheet, at: Point, radius: float, heading_deg: float) -> None:
    angle = math.radians(heading_deg)
    sheet.circle(at, radius, None, INK, 2.5)
    front = at[0] + 1.9 * radius * math.cos(angle), at[1] + 1.9 * radius * math.sin(angle)
    sheet.arrow(at, front, INK, 2.5, radius * 0.7)
