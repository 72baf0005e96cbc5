"""A room as an image: all objects and the floor from above, with names and scale."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from behaviors.ports import Pose
from nxtdrive.cli.views.room_sketch import absence, sound_words
from nxtdrive.drawing.blocks import Tag
from nxtdrive.drawing.floor_view import Area, Axes, FloorView
from nxtdrive.drawing.legend import Key, dot_sample, line_sample, marker_sample, patch_sample, ring_sample
from nxtdrive.drawing.page import Page, draw_page
from nxtdrive.drawing.sheet import DIM, INK, PAPER, Color, Sheet
from nxtdrive.recording.map.style import SEARCH, target_color
from sim_backend.world.placement import (
    outline_of_box,
    outline_of_carpet,
    outline_of_patch,
    outline_of_picture,
    outline_of_wall,
)
from sim_backend.world.toml_types import PAINTS, paint_name

if TYPE_CHECKING:
    from PIL import Image

    from sim_backend.world.sensor_tables import Patch
    from sim_backend.world.toml_types import Point
    from sim_backend.world.world_file import Box, Person, Wall, WorldFile

EDGE_MM, ARROW_PX = 150.0, 26.0
PERSON: Color = (60, 110, 160)
BOX: Color = (190, 194, 200)
NO_ECHO: Color = (225, 180, 225)
"""Fill of what absorbs ultrasound."""
CARPET: Color = (232, 218, 200)
IRON: Color = (150, 40, 120)
NOISE: Color = (190, 90, 0)
SHADE: Color = (165, 125, 0)
SENSOR: Color = (200, 30, 40)
WAVES_PX = (6.0, 11.0, 16.0)
"""Rings of a source of sound."""
SENSOR_PX, MAGNET_PX = 4.0, 6.5
RANGE_DASH = (6, 5)
BOARD_SHARES = (0.2, 0.4, 0.6, 0.8, 1.0)
ARROW_MM = (30.0, 60.0, 90.0)
"""Where on a picture's board and on its arrow names should not be."""
SIDE_POINTS = 8
"""Of each side of a box, where names should not be: in the middle of a large box they may."""
ROUND = 48
"""Corners of a dashed circle."""


def draw(world: WorldFile) -> Image.Image:
    """Draw the room from above."""
    return draw_page(room_page(world))


def room_page(world: WorldFile) -> Page:
    """Return the page with the room, its names and its legend."""
    width_mm, depth_mm = world.floor.size_mm
    tags = list(_tags(world))
    arrows = [Pose(*each.at_mm, each.facing_deg).ahead(far_mm) for each in world.pictures for far_mm in ARROW_MM]
    boards = [outline_of_picture(picture) for picture in world.pictures]
    busy = [point for board in boards for share in BOARD_SHARES for point in board.points(share)]
    busy += [point for box in world.boxes if box.present for point in _sides(outline_of_box(box).points(1.0))]
    return Page(
        title=world.title or "A room",
        subtitle=f"{width_mm:g} x {depth_mm:g} mm",
        area=_area(world),
        axes=Axes("x, m", "y, m", up=False),
        paint=lambda view: _paint(view, world),
        keys=list(_keys(world)),
        tags=tags,
        avoid=[world.robot.start_mm, *(tag.place for tag in tags), *arrows, *busy],
    )


def _sides(corners: Sequence[Point]) -> Iterator[Point]:
    """Yield points on the sides of a polygon."""
    for (x0, y0), (x1, y1) in pairwise([*corners, corners[0]]):
        for share in (i / SIDE_POINTS for i in range(SIDE_POINTS)):
            yield x0 + share * (x1 - x0), y0 + share * (y1 - y0)


def _area(world: WorldFile) -> Area:
    """Return the room with a margin that also holds people."""
    points = [(0.0, 0.0), world.floor.size_mm]
    for person in world.people:
        (x, y), radius = person.enters_from_mm, person.radius_mm
        points += [(x - radius, y - radius), (x + radius, y + radius)]
    return Area.around(points, EDGE_MM, 0.0)


def _tags(world: WorldFile) -> Iterator[Tag]:
    for i, picture in enumerate(world.pictures):
        yield Tag(picture.at_mm, picture.name + absence(present=picture.present), target_color(i), number=False)
    for box in world.boxes:
        yield Tag(box.at_mm, box.name + absence(present=box.present), INK, number=False)
    for person in world.people:
        yield Tag(person.enters_from_mm, person.name, PERSON, number=False)
    for sound in world.sounds:
        yield Tag(sound.at_mm, sound_words(sound), NOISE, number=False)
    for magnet in world.magnets:
        yield Tag(magnet.at_mm, f"{magnet.deflection_deg:g}°", IRON, number=False)
    for shade in world.shades:
        yield Tag(shade.at_mm, f"light x {shade.exposure:g}", SHADE, number=False)


def _keys(world: WorldFile) -> Iterator[Key]:
    yield Key("the robot, and where it faces", lambda sheet, at: _paint_arrow(sheet, at, 0.0, 9.0, SEARCH))
    if _sensor_places(world):
        yield Key("a sensor on it", dot_sample(SENSOR_PX, SENSOR))
    if world.pictures:
        yield Key("picture, and where it faces", line_sample(target_color(0), 5.0))
    if world.boxes:
        yield Key("box", patch_sample(BOX, INK))
    if world.walls:
        yield Key("wall", patch_sample(INK, INK))
    if world.people:
        yield Key("where a person comes in", ring_sample(9.0, PERSON, 2.5))
    solids: list[Wall | Box | Person] = [*world.walls, *world.boxes, *world.people]
    if any(solid.absorbs for solid in solids):
        yield Key("gives no ultrasonic echo", patch_sample(NO_ECHO, INK))
    yield from _floor_keys(world)


def _floor_keys(world: WorldFile) -> Iterator[Key]:
    if _painted(world):
        yield Key(f"floor, {paint_name(world.floor.color)}", patch_sample(_color(world.floor.color), INK))
    for text, color in {_patch_words(patch): _color(patch.color) for patch in world.patches}.items():
        yield Key(text, patch_sample(color, INK))
    if world.carpets:
        yield Key("carpet", patch_sample(CARPET, DIM))
    if world.sounds:
        yield Key("source of sound", lambda sheet, at: _paint_waves(sheet, at, WAVES_PX[:2]))
    if world.magnets:
        yield Key("magnet or iron, and its range", marker_sample("diamond", IRON, MAGNET_PX))
    if world.shades:
        yield Key("where the light is different", line_sample(SHADE, 2.0, RANGE_DASH))


def _patch_words(patch: Patch) -> str:
    return f"{paint_name(patch.color)} {'tape' if patch.along_mm else 'patch'}"


def _painted(world: WorldFile) -> bool:
    """Return whether the colour of the floor matters: only light and colour sensors see it."""
    return bool(world.patches) or world.floor.color != PAINTS["grey"]


def _color(paint: tuple[float, float, float]) -> Color:
    """Return how a paint appears: sRGB of the light that it reflects."""
    red, green, blue = (round(255 * (percent / 100) ** (1 / 2.2)) for percent in paint)
    return red, green, blue


def _sensor_places(world: WorldFile) -> list[Point]:
    """Return where on the floor the sensors that have a place on the robot are at the start."""
    places = [mount.at_mm for mount in world.sensors if mount.kind in ("light", "color", "ultrasonic")]
    if world.robot.ultrasonic_port:
        places.append((world.ultrasonic.forward_mm, 0.0))
    (x, y), angle = world.robot.start_mm, math.radians(world.robot.heading_deg)
    cos, sin = math.cos(angle), math.sin(angle)
    return [(x + ahead * cos - right * sin, y + ahead * sin + right * cos) for ahead, right in places]


def _paint(view: FloorView, world: WorldFile) -> None:
    sheet, (width_mm, depth_mm) = view.sheet, world.floor.size_mm
    _paint_floor(view, world)
    for box in world.boxes:
        if box.present:
            sheet.polygon(view.all_at(outline_of_box(box).points(1.0)), NO_ECHO if box.absorbs else BOX, INK, 1.5)
    for wall in world.walls:
        corners = view.all_at(outline_of_wall(wall, "wall").points(1.0))
        sheet.polygon(corners, NO_ECHO if wall.absorbs else INK, INK, 1.5)
    (left, top), (right, bottom) = view.all_at([(0.0, 0.0), (width_mm, depth_mm)])
    sheet.box((left, top, right, bottom), None, INK, 4.0)
    for person in world.people:
        fill = NO_ECHO if person.absorbs else None
        sheet.circle(view.at(person.enters_from_mm), person.radius_mm * view.scale, fill, PERSON, 2.5)
    for i, picture in enumerate(world.pictures):
        corners = view.all_at(outline_of_picture(picture).points(1.0))
        sheet.line([*corners, corners[0]], target_color(i), 5.0)
        _paint_arrow(sheet, view.at(picture.at_mm), picture.facing_deg, 0.0, target_color(i))
    radius = world.robot.radius_mm * view.scale
    _paint_arrow(sheet, view.at(world.robot.start_mm), world.robot.heading_deg, radius, SEARCH)
    for place in _sensor_places(world):
        sheet.circle(view.at(place), SENSOR_PX, SENSOR)


def _paint_floor(view: FloorView, world: WorldFile) -> None:
    sheet = view.sheet
    (left, top), (right, bottom) = view.all_at([(0.0, 0.0), world.floor.size_mm])
    if _painted(world):
        sheet.box((left, top, right, bottom), _color(world.floor.color))
        view.draw_grid()
    for carpet in world.carpets:
        sheet.polygon(view.all_at(outline_of_carpet(carpet).points(1.0)), CARPET, DIM, 1.0)
    for patch in world.patches:
        if (outline := outline_of_patch(patch)) is None:
            sheet.line(view.all_at(patch.along_mm), _color(patch.color), max(2.0, patch.width_mm * view.scale))
        else:
            sheet.polygon(view.all_at(outline.points(1.0)), _color(patch.color))
    if world.carpets or world.patches:  # which end at the walls
        for rows in ((0, top), (bottom, sheet.height)):
            sheet.box((0, rows[0], sheet.width, rows[1]), PAPER)
        for columns in ((0, left), (right, sheet.width)):
            sheet.box((columns[0], top, columns[1], bottom), PAPER)
    for shade in world.shades:
        _paint_range(view, shade.at_mm, shade.radius_mm, SHADE)
    for magnet in world.magnets:
        _paint_range(view, magnet.at_mm, magnet.radius_mm, IRON)
        sheet.marker("diamond", view.at(magnet.at_mm), MAGNET_PX, IRON)
    for sound in world.sounds:
        _paint_waves(sheet, view.at(sound.at_mm), WAVES_PX)


def _paint_range(view: FloorView, at_mm: Point, radius_mm: float, color: Color) -> None:
    circle = [Pose(*at_mm).ahead(radius_mm, 360.0 * i / ROUND) for i in range(ROUND + 1)]
    view.sheet.line(view.all_at(circle), color, 1.5, RANGE_DASH)


def _paint_waves(sheet: Sheet, at: Point, radii: tuple[float, ...]) -> None:
    for radius in radii:
        sheet.circle(at, radius, None, NOISE, 2.0)


def _paint_arrow(sheet: Sheet, at: Point, angle_deg: float, radius: float, color: Color) -> None:
    """Draw an arrow, from the middle of a circle if that has a radius."""
    if radius:
        sheet.circle(at, radius, None, color, 3.0)
    sheet.arrow(at, Pose(*at, angle_deg).ahead(max(2 * radius, ARROW_PX)), color, 2.5, 12.0)
