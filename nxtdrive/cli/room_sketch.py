"""A room as text and as an image: all objects, with names and scale."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from nxtdrive.drawing.blocks import Tag
from nxtdrive.drawing.floor_view import Area, Axes, FloorView
from nxtdrive.drawing.legend import Key, line_sample, patch_sample, ring_sample
from nxtdrive.drawing.page import Page, draw_page
from nxtdrive.drawing.sheet import INK, Color, Sheet
from nxtdrive.recording.map_style import SEARCH, target_color
from sim_backend.world.placement import Outline, outline_of_box, outline_of_picture, outline_of_wall

if TYPE_CHECKING:
    from PIL import Image

    from sim_backend.world.toml_types import Point
    from sim_backend.world.world_file import WorldFile

COLUMNS = ROWS = 72
"""Largest size of the text."""
ASPECT = 2.0
"""Height of a character divided by its width."""
ARROWS = ">v<^"
EDGE_MM, ARROW_PX = 150.0, 26.0
PERSON: Color = (60, 110, 160)
BOX: Color = (190, 194, 200)


def sketch(world: WorldFile) -> str:
    """Return the room as text: the map, and below it a list of the objects."""
    width_mm, depth_mm = world.floor.size_mm
    cell_mm = max(width_mm / COLUMNS, depth_mm / ASPECT / ROWS)
    columns, rows = max(3, round(width_mm / cell_mm)), max(3, round(depth_mm / cell_mm / ASPECT))
    text = [[" "] * columns for _ in range(rows)]

    def put(point: Point, letters: str) -> None:
        row = min(rows - 1, max(0, int(point[1] / cell_mm / ASPECT)))
        column = max(0, min(columns - len(letters), int(point[0] / cell_mm)))
        text[row][column : column + len(letters)] = letters[: columns - column]

    for outline, letter in _outlines(world):
        for point in _inside(outline, cell_mm):
            put(point, letter)
    for box in world.boxes:
        if box.present:
            put(box.at_mm, f"[{box.name}]")
    for person in world.people:
        put(person.enters_from_mm, f"({person.name})")
    for picture in world.pictures:
        if picture.present:
            put(picture.at_mm, f"{_arrow(picture.facing_deg)}{picture.name}")
    put(world.robot.start_mm, f"R{_arrow(world.robot.heading_deg)}")
    edge = "+" + "-" * columns + "+"
    lines = [edge, *("|" + "".join(row) + "|" for row in text), edge]
    lines.append(f"{width_mm:g} x {depth_mm:g} mm; a character is {cell_mm:.0f} x {ASPECT * cell_mm:.0f} mm")
    return "\n".join([*lines, "", *_legend(world)])


def _legend(world: WorldFile) -> Iterator[str]:
    robot = world.robot
    yield f"R  the robot at {_at(robot.start_mm)}, heading {robot.heading_deg:g}°"
    for picture in world.pictures:
        yield (
            f"{_arrow(picture.facing_deg)}  picture {picture.name!r} at {_at(picture.at_mm)}, facing "
            f"{picture.facing_deg:g}°, {picture.size_mm[0]:g} x {picture.size_mm[1]:g} mm" + _later(picture.present)
        )
    for box in world.boxes:
        size = f"{box.size_mm[0]:g} x {box.size_mm[1]:g} mm"
        yield f"#  box {box.name!r} at {_at(box.at_mm)}, {size}, {box.height_mm:g} high" + _later(box.present)
    for person in world.people:
        yield f"() {person.name!r} comes in at {_at(person.enters_from_mm)}"
    for event in world.events:
        yield f"   event: {event.name}"


def _later(present: bool) -> str:
    return "" if present else ", not there at the start"


def _at(point: Point) -> str:
    return f"({point[0]:g}, {point[1]:g})"


def _arrow(angle_deg: float) -> str:
    return ARROWS[round(angle_deg / 90) % 4]


def _outlines(world: WorldFile) -> Iterator[tuple[Outline, str]]:
    for wall in world.walls:
        yield outline_of_wall(wall, "wall"), "="
    for box in world.boxes:
        if box.present:
            yield outline_of_box(box), "#"


def _inside(outline: Outline, step_mm: float) -> Iterator[Point]:
    """Yield points that cover an outline, no farther apart than half a step."""
    along, across = (max(2, math.ceil(2 * size_mm / step_mm)) for size_mm in outline.size_mm)
    (x0, y0), (x1, y1), (x2, y2), _ = outline.points(0.98)
    for i in np.linspace(0, 1, along):
        for j in np.linspace(0, 1, across):
            yield float(x2 + i * (x1 - x2) + j * (x0 - x1)), float(y2 + i * (y1 - y2) + j * (y0 - y1))


def draw(world: WorldFile) -> Image.Image:
    """Draw the room from above."""
    width_mm, depth_mm = world.floor.size_mm
    people = [Tag(person.enters_from_mm, person.name, PERSON, number=False) for person in world.people]
    boxes = [Tag(box.at_mm, box.name + _later(box.present), INK, number=False) for box in world.boxes]
    pictures = [
        Tag(picture.at_mm, picture.name + _later(picture.present), target_color(i), number=False)
        for i, picture in enumerate(world.pictures)
    ]
    page = Page(
        title=world.title or "A room",
        subtitle=f"{width_mm:g} x {depth_mm:g} mm",
        area=Area(-EDGE_MM, -EDGE_MM, width_mm + EDGE_MM, depth_mm + EDGE_MM),
        axes=Axes("x, m", "y, m", up=False),
        paint=lambda view: _paint(view, world),
        keys=list(_keys(world)),
        tags=[*pictures, *boxes, *people],
        avoid=[world.robot.start_mm, *(tag.place for tag in (*pictures, *people))],
    )
    return draw_page(page)


def _keys(world: WorldFile) -> Iterator[Key]:
    yield Key("the robot, and where it faces", lambda sheet, at: _paint_arrow(sheet, at, 0.0, 9.0, SEARCH))
    if world.pictures:
        yield Key("picture, and where it faces", line_sample(target_color(0), 5.0))
    if world.boxes:
        yield Key("box", patch_sample(BOX, INK))
    if world.walls:
        yield Key("wall", patch_sample(INK, INK))
    if world.people:
        yield Key("where a person comes in", ring_sample(9.0, PERSON, 2.5))


def _paint(view: FloorView, world: WorldFile) -> None:
    sheet, (width_mm, depth_mm) = view.sheet, world.floor.size_mm
    for outline, letter in _outlines(world):
        sheet.polygon(view.all_at(outline.points(1.0)), BOX if letter == "#" else INK, INK, 1.5)
    (left, top), (right, bottom) = view.all_at([(0.0, 0.0), (width_mm, depth_mm)])
    sheet.box((left, top, right, bottom), None, INK, 4.0)
    for person in world.people:
        sheet.circle(view.at(person.enters_from_mm), person.radius_mm * view.scale, None, PERSON, 2.5)
    for i, picture in enumerate(world.pictures):
        corners = view.all_at(outline_of_picture(picture).points(1.0))
        sheet.line([*corners, corners[0]], target_color(i), 5.0)
        _paint_arrow(sheet, view.at(picture.at_mm), picture.facing_deg, 0.0, target_color(i))
    radius = world.robot.radius_mm * view.scale
    _paint_arrow(sheet, view.at(world.robot.start_mm), world.robot.heading_deg, radius, SEARCH)


def _paint_arrow(sheet: Sheet, at: Point, angle_deg: float, radius: float, color: Color) -> None:
    """Draw an arrow, from the middle of a circle if that has a radius."""
    if radius:
        sheet.circle(at, radius, None, color, 3.0)
    angle, length = math.radians(angle_deg), max(2 * radius, ARROW_PX)
    sheet.arrow(at, (at[0] + length * math.cos(angle), at[1] + length * math.sin(angle)), color, 2.5, 12.0)
