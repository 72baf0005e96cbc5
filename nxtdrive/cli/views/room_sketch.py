"""A room as text: a map of all objects, and a list of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sim_backend.world.placement import Outline, outline_of_box, outline_of_patch, outline_of_wall
from sim_backend.world.toml_types import paint_name

if TYPE_CHECKING:
    from sim_backend.world.sensor_tables import Mount, Patch, Sound
    from sim_backend.world.toml_types import Point
    from sim_backend.world.world_file import Robot, WorldFile

COLUMNS = ROWS = 72
"""Largest size of the map."""
LEAST_COLUMNS = 20
"""The map has at least this width, in however narrow a terminal."""
FRAME_COLUMNS = 2
ASPECT = 2.0
"""Height of a character divided by its width."""
MAX_STEPS = 4 * COLUMNS
"""A length is sampled at no more points than this: an object may be larger than the room."""
ARROWS = ">v<^"
MAGNET, SOUND = "U", "!"
PAINT_LETTERS = {"black": "k", "blue": "b", "green": "g", "yellow": "y", "red": "r", "white": "w", "grey": "e"}
OTHER_PAINT = "x"


def sketch(world: WorldFile, width: int | None = None) -> str:
    """Return the room as text: the map, and below it a list of the objects.

    Args:
        world: The room.
        width: Columns that a line of the map may have; None for as many as it needs.
    """
    width_mm, depth_mm = world.floor.size_mm
    columns = COLUMNS if width is None else max(LEAST_COLUMNS, min(COLUMNS, width - FRAME_COLUMNS))
    room = _Map(width_mm, depth_mm, columns)
    for patch in world.patches:
        for point in _covered(patch, room.cell_mm):
            if 0 <= point[0] <= width_mm and 0 <= point[1] <= depth_mm:
                room.put(point, _letter(patch))
    for outline, letter in _outlines(world):
        for point in _inside(outline, room.cell_mm):
            room.put(point, letter)
    for magnet in world.magnets:
        room.mark(magnet.at_mm, MAGNET)
    for sound in world.sounds:
        room.mark(sound.at_mm, SOUND)
    for box in world.boxes:
        if box.present:
            room.put(box.at_mm, f"[{box.name}]")
    for person in world.people:
        room.put(person.enters_from_mm, f"({person.name})")
    for picture in world.pictures:
        if picture.present:
            room.put(picture.at_mm, f"{_arrow(picture.facing_deg)}{picture.name}")
    room.put(world.robot.start_mm, f"R{_arrow(world.robot.heading_deg)}")
    size = f"{width_mm:g} x {depth_mm:g} mm; a character is {room.cell_mm:.0f} x {ASPECT * room.cell_mm:.0f} mm"
    return "\n".join([*room.lines(), size, "", *_robot_lines(world), *_floor_lines(world), *_object_lines(world)])


class _Map:
    """The room in characters.

    Args:
        width_mm: Of the room.
        depth_mm: Of the room.
        columns: The map has at most so many.
    """

    def __init__(self, width_mm: float, depth_mm: float, columns: int) -> None:
        self.cell_mm = max(width_mm / columns, depth_mm / ASPECT / ROWS)
        self._columns = max(3, round(width_mm / self.cell_mm))
        rows = max(3, round(depth_mm / self.cell_mm / ASPECT))
        self._text = [[" "] * self._columns for _ in range(rows)]

    def put(self, point: Point, letters: str) -> None:
        """Write over what is there; inside the map even if the point is not."""
        row, column = self._cell(point, len(letters))
        self._text[row][column : column + len(letters)] = letters[: self._columns - column]

    def mark(self, point: Point, letter: str) -> None:
        """Write a mark, beside other marks at the same place."""
        row, column = self._cell(point, 1)
        while self._text[row][column] in (MAGNET, SOUND) and column < self._columns - 1:
            column += 1
        self._text[row][column] = letter

    def lines(self) -> list[str]:
        """Return the map in its frame."""
        edge = "+" + "-" * self._columns + "+"
        return [edge, *("|" + "".join(row) + "|" for row in self._text), edge]

    def _cell(self, point: Point, length: int) -> tuple[int, int]:
        row = min(len(self._text) - 1, max(0, int(point[1] / self.cell_mm / ASPECT)))
        return row, max(0, min(self._columns - length, int(point[0] / self.cell_mm)))


def _robot_lines(world: WorldFile) -> Iterator[str]:
    robot = world.robot
    yield f"R  the robot at {_at(robot.start_mm)}, heading {robot.heading_deg:g}°"
    for port, sensor in sorted([*_robot_sensors(robot), *((mount.port, _sensor(mount)) for mount in world.sensors)]):
        yield f"   port {port}: {sensor}"


def _robot_sensors(robot: Robot) -> Iterator[tuple[int, str]]:
    if robot.touch_port:
        yield robot.touch_port, "touch"
    if robot.ultrasonic_port:
        yield robot.ultrasonic_port, "ultrasonic"


def _sensor(mount: Mount) -> str:
    place: Point | None = getattr(mount, "at_mm", None)
    direction_deg: float | None = getattr(mount, "direction_deg", None)
    where = f", {place[0]:g} mm forward and {place[1]:g} right of the axle's middle" if place else ""
    return mount.kind + where + (f", towards {direction_deg:g}°" if direction_deg else "")


def _floor_lines(world: WorldFile) -> Iterator[str]:
    if world.patches:
        yield f"   the floor is {paint_name(world.floor.color)}"
    for patch in world.patches:
        color = paint_name(patch.color)
        if (outline := outline_of_patch(patch)) is None:
            corners = " ".join(_at(corner) for corner in patch.along_mm)
            yield f"{_letter(patch)}  {color} tape, {patch.width_mm:g} mm wide, along {corners}"
        else:
            size = f"{outline.size_mm[0]:g} x {outline.size_mm[1]:g} mm"
            yield f"{_letter(patch)}  {color} patch at {_at(outline.at_mm)}, {size}"
    for carpet in world.carpets:
        yield f"   carpet at {_at(carpet.at_mm)}, {carpet.size_mm[0]:g} x {carpet.size_mm[1]:g} mm"
    for magnet in world.magnets:
        yield f"{MAGNET}  magnet at {_at(magnet.at_mm)}, {magnet.deflection_deg:g}° within {magnet.radius_mm:g} mm"
    for sound in world.sounds:
        yield f"{SOUND}  sound at {_at(sound.at_mm)}, {sound_words(sound)}"
    for shade in world.shades:
        yield f"   light times {shade.exposure:g} at {_at(shade.at_mm)}, within {shade.radius_mm:g} mm"


def _object_lines(world: WorldFile) -> Iterator[str]:
    for picture in world.pictures:
        yield (
            f"{_arrow(picture.facing_deg)}  picture {picture.name!r} at {_at(picture.at_mm)}, facing "
            f"{picture.facing_deg:g}°, {picture.size_mm[0]:g} x {picture.size_mm[1]:g} mm"
            + absence(present=picture.present)
        )
    for wall in world.walls:
        yield f"=  wall from {_at(wall.from_mm)} to {_at(wall.to_mm)}, {wall.height_mm:g} high" + _echo(
            absorbs=wall.absorbs
        )
    for box in world.boxes:
        size = f"{box.size_mm[0]:g} x {box.size_mm[1]:g} mm"
        notes = _echo(absorbs=box.absorbs) + absence(present=box.present)
        yield f"#  box {box.name!r} at {_at(box.at_mm)}, {size}, {box.height_mm:g} high{notes}"
    for person in world.people:
        yield f"() {person.name!r} comes in at {_at(person.enters_from_mm)}" + _echo(absorbs=person.absorbs)
    for event in world.events:
        yield f"   event: {event.name}"


def _echo(*, absorbs: bool) -> str:
    return ", gives no echo" if absorbs else ""


def absence(*, present: bool) -> str:
    """Return what to add to the name of an object that may be absent at the start."""
    return "" if present else ", not there at the start"


def sound_words(sound: Sound) -> str:
    """Return how loud a source of sound is, and when."""
    words = f"{sound.level_db:g} dB"
    words += f" from {sound.from_s:g} s" if sound.from_s else ""
    return words + (f" for {sound.for_s:g} s" if sound.for_s else "")


def _at(point: Point) -> str:
    return f"({point[0]:g}, {point[1]:g})"


def _arrow(angle_deg: float) -> str:
    return ARROWS[round(angle_deg / 90) % 4]


def _letter(patch: Patch) -> str:
    return PAINT_LETTERS.get(paint_name(patch.color), OTHER_PAINT)


def _outlines(world: WorldFile) -> Iterator[tuple[Outline, str]]:
    for wall in world.walls:
        yield outline_of_wall(wall, "wall"), "="
    for box in world.boxes:
        if box.present:
            yield outline_of_box(box), "#"


def _covered(patch: Patch, step_mm: float) -> Iterator[Point]:
    """Yield points of a patch, or along the middle of a tape, no farther apart than half a step."""
    if (outline := outline_of_patch(patch)) is not None:
        yield from _inside(outline, step_mm)
    for (x0, y0), (x1, y1) in pairwise(patch.along_mm):
        for i in np.linspace(0, 1, _steps(math.hypot(x1 - x0, y1 - y0), step_mm)):
            yield float(x0 + i * (x1 - x0)), float(y0 + i * (y1 - y0))


def _inside(outline: Outline, step_mm: float) -> Iterator[Point]:
    """Yield points that cover an outline, no farther apart than half a step."""
    along, across = (_steps(size_mm, step_mm) for size_mm in outline.size_mm)
    (x0, y0), (x1, y1), (x2, y2), _ = outline.points(0.98)
    for i in np.linspace(0, 1, along):
        for j in np.linspace(0, 1, across):
            yield float(x2 + i * (x1 - x2) + j * (x0 - x1)), float(y2 + i * (y1 - y2) + j * (y0 - y1))


def _steps(length_mm: float, step_mm: float) -> int:
    return min(MAX_STEPS, max(2, math.ceil(2 * length_mm / step_mm)))
