"""Whether the objects of a world file can stand where they are placed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from sim_backend.plane import along_and_across, corners_of
from sim_backend.world.objects import STAND_THICKNESS_MM
from sim_backend.world.sensor_tables import Patch
from sim_backend.world.toml_types import ROOM_M, Point, in_other_unit
from sim_backend.world.world_file import Box, Carpet, Picture, Wall, WorldFile

OVERLAP_TOLERANCE_MM = 1.0
"""Objects may overlap by this much; they touch."""


@dataclass(frozen=True, slots=True)
class Outline:
    """A rectangle on the floor.

    Attributes:
        what: Its name in a sentence.
        at_mm: Its middle.
        size_mm: Along and across its facing.
        facing_deg: Clockwise from +x.
        height_mm: Upper edge above the floor.
    """

    what: str
    at_mm: Point
    size_mm: tuple[float, float]
    facing_deg: float
    height_mm: float

    def distance_mm(self, point: Point) -> float:
        """Return the distance of a point from it; 0 inside."""
        along, across = along_and_across(point[0] - self.at_mm[0], point[1] - self.at_mm[1], self.facing_deg)
        return math.hypot(max(abs(along) - self.size_mm[0] / 2, 0.0), max(abs(across) - self.size_mm[1] / 2, 0.0))

    def is_near(self, other: Outline) -> bool:
        """Return whether the circles around both overlap; outlines that touch are near each other."""
        reach_mm = (math.hypot(*self.size_mm) + math.hypot(*other.size_mm)) / 2
        return math.dist(self.at_mm, other.at_mm) <= reach_mm

    def points(self, share: float) -> list[Point]:
        """Return its four corners, drawn in towards the middle to this share."""
        size_mm = share * self.size_mm[0], share * self.size_mm[1]
        return corners_of(self.at_mm, size_mm, math.radians(self.facing_deg))


def outline_of_wall(wall: Wall, what: str) -> Outline:
    """Return the outline of an inner wall."""
    (x0, y0), (x1, y1) = wall.from_mm, wall.to_mm
    size_mm = math.hypot(x1 - x0, y1 - y0), wall.thickness_mm
    facing_deg = math.degrees(math.atan2(y1 - y0, x1 - x0))
    return Outline(what, ((x0 + x1) / 2, (y0 + y1) / 2), size_mm, facing_deg, wall.height_mm)


def outline_of_box(box: Box) -> Outline:
    """Return the outline of a box."""
    return Outline(f"the box {box.name!r}", box.at_mm, box.size_mm, box.facing_deg, box.height_mm)


def outline_of_picture(picture: Picture) -> Outline:
    """Return the outline of a picture's board."""
    size_mm = STAND_THICKNESS_MM, picture.size_mm[0]
    top_mm = picture.centre_height_mm + picture.size_mm[1] / 2
    return Outline(repr(picture.name), picture.at_mm, size_mm, picture.facing_deg, top_mm)


def outline_of_patch(patch: Patch) -> Outline | None:
    """Return the outline of a patch on the floor; None of tape."""
    if patch.at_mm is None or patch.size_mm is None:
        return None
    return Outline("the patch", patch.at_mm, patch.size_mm, patch.facing_deg, 0.0)


def outline_of_carpet(carpet: Carpet) -> Outline:
    """Return the outline of a carpet."""
    return Outline("the carpet", carpet.at_mm, carpet.size_mm, carpet.facing_deg, 0.0)


def solid_outlines(world: WorldFile) -> list[Outline]:
    """Return the outlines of the inner walls, and of the boxes that are present at the start."""
    walls = [outline_of_wall(wall, f"walls[{index}]") for index, wall in enumerate(world.walls)]
    return [*walls, *(outline_of_box(box) for box in world.boxes if box.present)]


def misplaced(world: WorldFile) -> Iterator[str]:
    """Yield a sentence for each object of a world that cannot be where it is placed."""
    solid = solid_outlines(world)
    yield from _misplaced_robot(world, solid)
    for index, wall in enumerate(world.walls):
        for key, end in (("from_mm", wall.from_mm), ("to_mm", wall.to_mm)):
            if _out_mm(world, end) > OVERLAP_TOLERANCE_MM:
                yield f"walls[{index}].{key}: {_place(end)} is outside the floor; end the wall at the room's edge"
    for index, picture in enumerate(world.pictures):
        yield from _misplaced_picture(world, f"pictures[{index}].at_mm", picture, solid)


def _misplaced_robot(world: WorldFile, solid: list[Outline]) -> Iterator[str]:
    robot = world.robot
    if _out_mm(world, robot.start_mm) > 0:
        return  # reported as outside the floor
    around = f"it needs {robot.radius_mm:g} mm around it"
    for outline in solid:
        if outline.distance_mm(robot.start_mm) < robot.radius_mm - OVERLAP_TOLERANCE_MM:
            yield f"robot.start_mm: the robot stands in {outline.what}; {around}"
    (x, y), (width, depth) = robot.start_mm, world.floor.size_mm
    if min(x, y, width - x, depth - y) < robot.radius_mm - OVERLAP_TOLERANCE_MM:
        more = f"; if floor.size_mm is {in_other_unit(world.floor.size_mm, ROOM_M)}" if world.floor.is_tiny else ""
        yield f"robot.start_mm: the robot stands in the wall of the room; {around}{more}"


def _misplaced_picture(world: WorldFile, path: str, picture: Picture, solid: list[Outline]) -> Iterator[str]:
    board = outline_of_picture(picture)
    yield from _sticking_out(world, path, board)
    if not picture.present:
        return
    bottom_mm = picture.centre_height_mm - picture.size_mm[1] / 2
    front = [picture.at_mm, *board.points(0.5)]
    for outline in solid:
        inside = outline.is_near(board) and any(outline.distance_mm(point) == 0.0 for point in front)
        if inside and outline.height_mm > bottom_mm:
            yield (
                f"{path}: {picture.name!r} is inside {outline.what}, where it cannot be seen; put it in front, "
                f"or above with a larger centre_height_mm"
            )
    if board.distance_mm(world.robot.start_mm) < world.robot.radius_mm - OVERLAP_TOLERANCE_MM:
        yield f"{path}: {picture.name!r} stands where the robot starts; keep {world.robot.radius_mm:g} mm from it"


def _sticking_out(world: WorldFile, path: str, outline: Outline) -> Iterator[str]:
    out_mm = max(_out_mm(world, corner) for corner in outline.points(1.0))
    if out_mm > OVERLAP_TOLERANCE_MM and _out_mm(world, outline.at_mm) == 0.0:  # else reported as outside the floor
        yield f"{path}: {outline.what} sticks out of the room by {out_mm:.0f} mm; move it inwards"


def _out_mm(world: WorldFile, point: Point) -> float:
    """Return how far outside the floor a point is; 0 on the floor."""
    (x, y), (width, depth) = point, world.floor.size_mm
    return max(0.0, -x, -y, x - width, y - depth)


def _place(point: Point) -> str:
    return f"({point[0]:g}, {point[1]:g})"
