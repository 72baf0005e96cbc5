"""A room as text and as an image: what stands where, with names and scale."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import cv2
import numpy as np

from nxtdrive.recording.map_picture import ECHO, GRID, INK, PAPER, SEARCH, TARGET_COLORS, Color, Image, write
from sim_backend.world.placement import Outline, outline_of_box, outline_of_picture, outline_of_wall

if TYPE_CHECKING:
    from sim_backend.world.toml_types import Point
    from sim_backend.world.world_file import WorldFile

COLUMNS = ROWS = 72
"""Of the text, at most."""
ASPECT = 2.0
"""Height of a character divided by its width."""
ARROWS = ">v<^"
LONGEST_PX, MARGIN_PX = 900, 50
PERSON: Color = (160, 110, 60)


def sketch(world: WorldFile) -> str:
    """Return the room as text: the map, and below it what stands where."""
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


def draw(world: WorldFile) -> Image:
    """Draw the room from above; BGR."""
    width_mm, depth_mm = world.floor.size_mm
    scale = LONGEST_PX / max(width_mm, depth_mm)
    width_px, depth_px = (round(scale * size_mm) + 2 * MARGIN_PX for size_mm in (width_mm, depth_mm))
    image: Image = np.full((depth_px, width_px, 3), PAPER, np.uint8)

    def at(point: Point) -> tuple[int, int]:
        return round(point[0] * scale) + MARGIN_PX, round(point[1] * scale) + MARGIN_PX

    for i in range(1, math.ceil(width_mm / 500)):
        cv2.line(image, at((500.0 * i, 0)), at((500.0 * i, depth_mm)), GRID, 1)
    for i in range(1, math.ceil(depth_mm / 500)):
        cv2.line(image, at((0, 500.0 * i)), at((width_mm, 500.0 * i)), GRID, 1)
    cv2.rectangle(image, at((0, 0)), at((width_mm, depth_mm)), INK, 3)
    for outline, letter in _outlines(world):
        corners = np.array([at(corner) for corner in outline.points(1.0)], np.int32)
        cv2.fillPoly(image, [corners], ECHO if letter == "#" else INK, cv2.LINE_AA)
    for box in world.boxes:
        _label(image, at(box.at_mm), box.name + _later(box.present), INK)
    for person in world.people:
        cv2.circle(image, at(person.enters_from_mm), round(person.radius_mm * scale), PERSON, 2, cv2.LINE_AA)
        _label(image, at(person.enters_from_mm), person.name, PERSON)
    for i, picture in enumerate(world.pictures):
        color, board = TARGET_COLORS[i % len(TARGET_COLORS)], outline_of_picture(picture)
        corners = np.array([at(corner) for corner in board.points(1.0)], np.int32)
        cv2.polylines(image, [corners], True, color, 4, cv2.LINE_AA)
        _arrowed(image, at(picture.at_mm), picture.facing_deg, 40, color)
        _label(image, at(picture.at_mm), picture.name + _later(picture.present), color)
    cv2.circle(image, at(world.robot.start_mm), round(world.robot.radius_mm * scale), SEARCH, 2, cv2.LINE_AA)
    _arrowed(image, at(world.robot.start_mm), world.robot.heading_deg, round(200 * scale), SEARCH)
    _label(image, at(world.robot.start_mm), "robot", SEARCH)
    write(image, world.title, (MARGIN_PX, 30), INK, 0.5)
    scale_text = f"{width_mm:g} x {depth_mm:g} mm, a line every 500 mm"
    write(image, scale_text, (MARGIN_PX, image.shape[0] - 15), INK, 0.5)
    return image


def _label(image: Image, place: tuple[int, int], text: str, color: Color) -> None:
    write(image, text, (place[0] + 12, place[1] + 20), color, 0.5)


def _arrowed(image: Image, place: tuple[int, int], angle_deg: float, length: int, color: Color) -> None:
    angle = math.radians(angle_deg)
    end = round(place[0] + length * math.cos(angle)), round(place[1] + length * math.sin(angle))
    cv2.arrowedLine(image, place, end, color, 2, cv2.LINE_AA, tipLength=0.35)
