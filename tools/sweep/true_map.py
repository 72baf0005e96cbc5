"""Draw the true map of one run: the room, its objects, the robot's path, and its stops."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby

from PIL import Image

from behaviors.ports import Pose
from nxtdrive.drawing.blocks import Note, Tag
from nxtdrive.drawing.floor_view import Area, Axes, FloorView
from nxtdrive.drawing.legend import Key, line_sample, marker_sample, patch_sample, ring_sample
from nxtdrive.drawing.page import Page, draw_page
from nxtdrive.drawing.sheet import DIM, INK, Color, Sheet
from nxtdrive.recording.map.events import EventReader, MapEvent, Numbering, numbering
from nxtdrive.recording.map.map_drawing import START_MARK_MM, number_notes
from nxtdrive.recording.map.style import ARRIVE, FAILED, TARGET_COLORS, LineStyle, MarkStyle, mark_style
from nxtdrive.recording.wording import spaced
from sim_backend.evaluation import stop_counts
from sim_backend.plane import Point, corners_of
from sim_backend.scenarios.floor_plan import Goal, Obstacle
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM

from .truth_recorder import SAMPLE_MS, EpisodeTrace, TruthSample

AXES = Axes("room: x, m", "room: y, m", up=False)
EDGE_MM = 150.0
"""Around the room."""
LOW_MM = 200.0
"""Objects lower than this hide no picture; they are drawn in outline."""
STANDING_SAMPLES = 10
"""A late object that stands still for this many samples is drawn."""
TICK_MM, TICK_PX = 500.0, 2.5
"""Between the dots on the axes through the start, and their radius."""
LABEL_PX = 90.0
"""A number on those axes that is nearer to the right edge than this is on the left of its dot."""
MARK_PX = 6.5

SOLID: Color = (190, 194, 200)
LATE: Color = (220, 140, 0)
START_AXES: Color = (75, 105, 165)
PATHS = (
    LineStyle("path for the first target", (30, 110, 190), 3.0),
    LineStyle("path for the second target", (150, 60, 180), 3.0, (12, 6)),
    LineStyle("path for a further target", TARGET_COLORS[1], 3.0, (4, 4)),
)
OTHER = LineStyle("path for no target", INK, 1.2)
WRONG_STOP = MarkStyle("arrival that does not count", FAILED, "tilted_cross")
RIGHT_STOP = MarkStyle("arrival that counts", ARRIVE, "star")


def draw_true_map(trace: EpisodeTrace, title: str) -> Image.Image:
    """Draw the map of one mission, an RGB picture."""
    return draw_page(true_map_page(trace, title))


def true_map_page(trace: EpisodeTrace, title: str) -> Page:
    """Compose the map of one mission."""
    events = dict(_events(trace))
    shown = numbering(list(events))
    width_mm, depth_mm = trace.samples[0].scene.plan.size_mm
    goals = [goal for goal in trace.samples[-1].scene.goals.values() if goal.name in trace.targets]
    return Page(
        title=title,
        subtitle="; ".join(_result(trace, events)),
        area=Area(-EDGE_MM, -EDGE_MM, width_mm + EDGE_MM, depth_mm + EDGE_MM),
        axes=AXES,
        paint=lambda view: _paint(view, trace, events),
        keys=list(_keys(trace, events)),
        heading="What happened" if shown.numbered else "",
        notes=list(_notes(shown, events)),
        tags=[
            *(Tag(goal.at_mm, goal.name, ARRIVE, number=False) for goal in goals),
            *_tags(shown, events),
            *_late_tags(trace),
        ],
        avoid=[sample.pose[:2] for sample in trace.samples[::3]],
        keep=[*(goal.at_mm for goal in goals), *map(_start(trace).ahead, START_MARK_MM)],
    )


def _result(trace: EpisodeTrace, events: dict[MapEvent, MarkStyle]) -> Iterator[str]:
    yield f"{spaced(trace.ending)} after {trace.duration_s:.1f} s"
    if trace.error:
        yield trace.error
    arrivals = {event.same[1]: (event, mark) for event, mark in events.items() if event.kind == "reached"}
    for target in trace.targets:
        if target not in arrivals:
            yield f"{target}: not reached"
            continue
        event, mark = arrivals[target]
        yield f"{target}: reached at {event.time_s:.1f} s" + (", does not count" if mark is WRONG_STOP else "")
    yield f"contacts: {trace.samples[-1].contacts}"
    yield "positions are the simulator's, not the robot's estimates"


def _events(trace: EpisodeTrace) -> Iterator[tuple[MapEvent, MarkStyle]]:
    """Yield the events of a mission at their true places, and how they are marked."""
    reader = EventReader()
    for entry in trace.entries:
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
        yield Tag(group.first.pose.point, str(number), events[group.first].color)


def _late_tags(trace: EpisodeTrace) -> Iterator[Tag]:
    for obstacle, spans in _late_objects(trace).items():
        when = ", ".join(f"{start_s:.0f} to {end_s:.0f} s" for start_s, end_s in spans)
        yield Tag(obstacle.at_mm, when, LATE, number=False)


def _start(trace: EpisodeTrace) -> Pose:
    return Pose(*trace.samples[0].pose)


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
    _paint_start_axes(view, trace)
    radius = ROBOT_RADIUS_MM * view.scale
    _paint_start(sheet, view.at(first.pose[:2]), radius, first.pose[2])
    _paint_end(sheet, view.at(trace.samples[-1].pose[:2]), radius, trace.samples[-1].pose[2])
    for event, mark in events.items():
        sheet.marker(mark.marker, view.at(event.pose.point), MARK_PX, mark.color)


def _keys(trace: EpisodeTrace, events: dict[MapEvent, MarkStyle]) -> Iterator[Key]:
    """Yield the legend of exactly what occurs."""
    yield Key("start, and where the robot faced", lambda sheet, at: _paint_start(sheet, at, 8.0, 0.0))
    yield Key("from the start, a dot each 0.5 m", line_sample(START_AXES, 1.5))
    yield Key("the robot at the end", lambda sheet, at: _paint_end(sheet, at, 8.0, 0.0))
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
    round_ones = {obstacle.size_mm == (0.0, 0.0) for obstacle in _late_objects(trace)}
    if True in round_ones:
        yield Key("person who stood there, when", ring_sample(9.0, LATE, 2.0))
    if False in round_ones:
        yield Key("object that came later, when", patch_sample((255, 255, 255), LATE))


def _pieces(trace: EpisodeTrace) -> Iterator[tuple[LineStyle, Sequence[Point]]]:
    """Yield the path in pieces, one for each stretch for one target."""
    entries = iter(trace.entries)
    entry, target = next(entries, None), ""
    piece: list[Point] = []
    for sample in trace.samples:
        piece.append(sample.pose[:2])
        before = target
        while entry is not None and entry.sample.time_s <= sample.time_s:
            target, entry = entry.record.target, next(entries, None)
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


def _late_objects(trace: EpisodeTrace) -> dict[Obstacle, list[tuple[float, float]]]:
    """Return the late objects at every place where one stood still, with the times from and to which it did."""
    found: dict[Obstacle, list[tuple[float, float]]] = {}
    for same_scene, group in groupby(trace.samples, key=lambda sample: sample.scene):
        samples = list(group)
        if len(samples) <= STANDING_SAMPLES or same_scene is trace.samples[0].scene:
            continue
        for each in same_scene.plan.obstacles:
            if each.name in trace.late_objects:
                _extend(found.setdefault(each, []), samples[0].time_s, samples[-1].time_s)
    return found


def _extend(spans: list[tuple[float, float]], start_s: float, end_s: float) -> None:
    """Add a span of time, or lengthen the last one that ends just before."""
    if spans and start_s - spans[-1][1] <= 2 * SAMPLE_MS / 1000:
        start_s = spans.pop()[0]
    spans.append((start_s, end_s))


def _paint_obstacle(view: FloorView, obstacle: Obstacle, fill: Color | None, outline: Color) -> None:
    if obstacle.size_mm == (0.0, 0.0):
        view.sheet.circle(view.at(obstacle.at_mm), obstacle.radius_mm * view.scale, fill, outline, 2.0)
        return
    along, across = (max(10.0, side + 2 * obstacle.radius_mm) for side in obstacle.size_mm)
    corners = corners_of(obstacle.at_mm, (along, across), math.radians(obstacle.facing_deg))
    view.sheet.polygon(view.all_at(corners), fill, outline, 2.0)


def _paint_picture(view: FloorView, goal: Goal, color: Color) -> None:
    picture, at = Pose(*goal.at_mm, goal.facing_deg), view.at(goal.at_mm)
    view.sheet.line(view.all_at([picture.ahead(80.0, -90.0), picture.ahead(80.0, 90.0)]), color, 5.0)
    view.sheet.arrow(at, Pose(*at, goal.facing_deg).ahead(26.0), color, 2.0, 11.0)


def _paint_start(sheet: Sheet, at: Point, radius: float, heading_deg: float) -> None:
    sheet.circle(at, radius, None, INK, 2.5)
    sheet.arrow(at, Pose(*at, heading_deg).ahead(1.9 * radius), INK, 2.5, radius * 0.7)


def _paint_end(sheet: Sheet, at: Point, radius: float, heading_deg: float) -> None:
    sheet.circle(at, radius, None, INK, 1.5)
    sheet.line([at, Pose(*at, heading_deg).ahead(radius)], INK, 1.5)


def _paint_start_axes(view: FloorView, trace: EpisodeTrace) -> None:
    """Draw the axes in which the notes say where a place is, as far as the room reaches, with whole metres."""
    width_mm, depth_mm = trace.samples[0].scene.plan.size_mm
    most = int(math.hypot(width_mm, depth_mm) / TICK_MM) + 1
    start = _start(trace)
    for names, bearing_deg in ((("ahead", "behind"), 0.0), (("right", "left"), 90.0)):
        inside = {}
        for i in range(-most, most + 1):
            x, y = start.ahead(i * TICK_MM, bearing_deg)
            if 0 <= x <= width_mm and 0 <= y <= depth_mm:
                inside[i] = view.at((x, y))
        view.sheet.line([inside[min(inside)], inside[max(inside)]], START_AXES, 1.5)
        for i, (x, y) in inside.items():
            view.sheet.circle((x, y), TICK_PX, START_AXES)
            if i and i % 2 == 0:
                anchor, aside = ("r", -6) if x > view.frame[2] - LABEL_PX else ("l", 6)
                view.sheet.text((x + aside, y - 6), f"{abs(i) // 2} m {names[i < 0]}", 14, START_AXES, anchor=anchor)
