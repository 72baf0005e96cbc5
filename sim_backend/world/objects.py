"""Objects on the floor: walls, boxes and pictures, as obstacles in the physics and as panels for the camera."""

from __future__ import annotations

import math
from typing import Protocol

import pymunk

from sim_backend.camera.scene import Panel, picture_panel, standing_panels
from sim_backend.plane import corners_of, on_map, sides_of
from sim_backend.world.robot import GRAVITY_MM_S2
from sim_backend.world.toml_types import Point
from sim_backend.world.world_file import Box, Floor, Picture, Wall

STAND_THICKNESS_MM = 10.0
POST_WIDTH_MM, POST_TEXTURE = 40.0, "wood"
BOX_FRICTION = 0.4
"""Coefficient of friction between a box and the floor."""
WAIT_GAP_MM = 50.0
"""People and riding pictures whose path the robot blocks wait at this distance from it."""


class WorldObject(Protocol):
    """An obstacle that the camera can see."""

    @property
    def height_mm(self) -> float:
        """Top edge above the floor."""

    @property
    def shapes(self) -> tuple[pymunk.Shape, ...]:
        """Outline in the physics."""

    @property
    def absorbs(self) -> bool:
        """Whether it absorbs ultrasound: neither it nor what is behind it gives an echo."""

    def panels(self) -> list[Panel]:
        """Return the surfaces that the camera sees; none while it is absent."""


class WallObject:
    """A fixed inner wall."""

    def __init__(self, space: pymunk.Space, wall: Wall) -> None:
        self.height_mm, self.absorbs, self._wall = wall.height_mm, wall.absorbs, wall
        segment = pymunk.Segment(space.static_body, wall.from_mm, wall.to_mm, wall.thickness_mm / 2)
        segment.friction = 0.5
        self.shapes: tuple[pymunk.Shape, ...] = (segment,)
        space.add(segment)

    def panels(self) -> list[Panel]:
        """Return four upright sides."""
        (x0, y0), (x1, y1) = self._wall.from_mm, self._wall.to_mm
        length = math.hypot(x1 - x0, y1 - y0)
        middle = (x0 + x1) / 2, (y0 + y1) / 2
        corners = corners_of(middle, (length, self._wall.thickness_mm), math.atan2(y1 - y0, x1 - x0))
        return standing_panels(corners, self.height_mm, self._wall.texture)


class RoomObject:
    """The four walls around the floor; their thickness lies outside the room."""

    THICKNESS_MM = 200.0
    absorbs = False

    def __init__(self, space: pymunk.Space, floor: Floor) -> None:
        self.height_mm, self._floor = floor.wall_height_mm, floor
        half = self.THICKNESS_MM / 2
        width, depth = floor.size_mm
        middles = [(-half, -half), (width + half, -half), (width + half, depth + half), (-half, depth + half)]
        self.shapes: tuple[pymunk.Shape, ...] = tuple(
            pymunk.Segment(space.static_body, start, end, half) for start, end in sides_of(middles)
        )
        for shape in self.shapes:
            shape.friction = 0.5
        space.add(*self.shapes)

    def panels(self) -> list[Panel]:
        """Return four upright sides that face inwards."""
        width, depth = self._floor.size_mm
        corners = [(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)]
        return [
            Panel(x0, y0, x1, y1, 0.0, self.height_mm, self._floor.wall_texture)
            for (x0, y0), (x1, y1) in sides_of(corners)
        ]


class PlacedObject:
    """An object with its own body, which events can move, remove and bring back."""

    def __init__(self, space: pymunk.Space, body: pymunk.Body, shape: pymunk.Shape, *, present: bool) -> None:
        self._space, self._body = space, body
        shape.friction = 0.4
        self.shapes: tuple[pymunk.Shape, ...] = (shape,)
        self.present = False
        self._attached: tuple[pymunk.Constraint, ...] = ()
        self._ride: tuple[Point, float] | None = None
        self._show(present)

    @property
    def at_mm(self) -> Point:
        """Centre on the map."""
        return float(self._body.position.x), float(self._body.position.y)

    @property
    def facing_deg(self) -> float:
        """Direction of the front, clockwise from +x."""
        return math.degrees(self._body.angle)

    @property
    def rides(self) -> bool:
        """Whether a vehicle carries it to another place."""
        return self._ride is not None

    @property
    def at_rest(self) -> bool:
        """Whether it is not being pushed."""
        return not self.present or (self._body.velocity.length < 0.05 and abs(self._body.angular_velocity) < 1e-3)

    def place(self, at_mm: Point | None, facing_deg: float | None, *, present: bool) -> None:
        """Move, remove or bring back the object; None keeps the position or the facing."""
        self._show(False)
        if at_mm is not None:
            self._body.position = at_mm
        if facing_deg is not None:
            self._body.angle = math.radians(facing_deg)
        self._body.velocity, self._body.angular_velocity = (0.0, 0.0), 0.0
        self._ride = None
        self._show(present)

    def ride(self, to_mm: Point, facing_deg: float | None, speed_mm_s: float) -> None:
        """Move to a place at a speed, as a slow vehicle does; None keeps the facing."""
        self.place(None, facing_deg, present=True)
        self._ride = to_mm, speed_mm_s

    def move_on(self, duration_s: float, reach_mm: float, robot_mm: Point) -> None:
        """Ride on for `duration_s`, or wait for the robot, which is nearer than `reach_mm` then."""
        if self._ride is None:
            return
        (goal, speed_mm_s), at = self._ride, self.at_mm
        left_mm, step_mm = math.dist(at, goal), speed_mm_s * duration_s
        if left_mm <= step_mm:
            self._body.position, self._ride = goal, None
        elif not blocked_by(robot_mm, at, goal, reach_mm):
            share = step_mm / left_mm
            self._body.position = at[0] + share * (goal[0] - at[0]), at[1] + share * (goal[1] - at[1])
        self._space.reindex_shapes_for_body(self._body)

    def _show(self, present: bool) -> None:
        members: list[pymunk.Body | pymunk.Shape | pymunk.Constraint] = [self._body, *self.shapes, *self._attached]
        if present and not self.present:
            self._space.add(*members)
        elif self.present and not present:
            self._space.remove(*members)
        self.present = present


class BoxObject(PlacedObject):
    """A box; one with a mass can be pushed, against friction on the floor.

    Attributes:
        movable: Whether the robot can push it.
        texture: Name in the texture library.
        radius_mm: From the centre to a corner.
    """

    def __init__(self, space: pymunk.Space, box: Box) -> None:
        self.name, self.height_mm, self.absorbs, self._box = box.name, box.height_mm, box.absorbs, box
        if box.mass_kg is None:
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
        else:
            body = pymunk.Body(box.mass_kg, pymunk.moment_for_box(box.mass_kg, box.size_mm))
        body.position, body.angle = box.at_mm, math.radians(box.facing_deg)
        super().__init__(space, body, pymunk.Poly.create_box(body, box.size_mm), present=False)
        self.radius_mm, self.texture = math.hypot(*box.size_mm) / 2, box.texture
        self.movable = box.mass_kg is not None
        if box.mass_kg is not None:
            self._attached = _friction(space.static_body, body, box.mass_kg, max(box.size_mm))
        self._show(box.present)

    def panels(self) -> list[Panel]:
        """Return four upright sides."""
        if not self.present:
            return []
        corners = corners_of(self.at_mm, self._box.size_mm, self._body.angle)
        return standing_panels(corners, self.height_mm, self._box.texture)


class PictureObject(PlacedObject):
    """A picture on a stand."""

    absorbs = False

    def __init__(self, space: pymunk.Space, picture: Picture) -> None:
        self.name, self._picture = picture.name, picture
        self.width_mm, self._print_height_mm = picture.size_mm
        self.radius_mm = self.width_mm / 2
        self.bottom_mm = picture.centre_height_mm - self._print_height_mm / 2
        self.height_mm = self.bottom_mm + self._print_height_mm
        self.centre_height_mm = picture.centre_height_mm
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        body.position, body.angle = picture.at_mm, math.radians(picture.facing_deg)
        board = pymunk.Poly.create_box(body, (STAND_THICKNESS_MM, self.width_mm))
        super().__init__(space, body, board, present=picture.present)

    @property
    def texture(self) -> str:
        """Name in the texture library, or path of the image file."""
        return self.name if self._picture.file is None else str(self._picture.file)

    def edge_points(self) -> tuple[Point, Point, Point]:
        """Return the points at a quarter, half and three quarters of the width."""
        left, right = (on_map(self.at_mm, self._body.angle, 0.0, side * self.width_mm / 4) for side in (-1, 1))
        return left, self.at_mm, right

    def panels(self) -> list[Panel]:
        """Return the print with its plain back, and the post under it."""
        if not self.present:
            return []
        x, y = self.at_mm
        size = {"width_mm": self.width_mm, "height_mm": self._print_height_mm, "bottom_mm": self.bottom_mm}
        post = {"width_mm": POST_WIDTH_MM, "height_mm": self.bottom_mm, "bottom_mm": 0.0}
        return [
            picture_panel(self.texture, x, y, self.facing_deg, **size),
            picture_panel(POST_TEXTURE, x, y, self.facing_deg, **post),
        ]


def blocked_by(robot_mm: Point, at_mm: Point, goal_mm: Point, reach_mm: float) -> bool:
    """Return whether the robot is nearer than `reach_mm` and on the side of the goal."""
    to_robot = robot_mm[0] - at_mm[0], robot_mm[1] - at_mm[1]
    towards = to_robot[0] * (goal_mm[0] - at_mm[0]) + to_robot[1] * (goal_mm[1] - at_mm[1]) > 0
    return towards and math.hypot(*to_robot) < reach_mm


def _friction(floor: pymunk.Body, body: pymunk.Body, mass_kg: float, size_mm: float) -> tuple[pymunk.Constraint, ...]:
    force = BOX_FRICTION * mass_kg * GRAVITY_MM_S2
    slide = pymunk.PivotJoint(floor, body, (0, 0), (0, 0))
    twist = pymunk.GearJoint(floor, body, 0.0, 1.0)
    slide.max_bias = twist.max_bias = 0.0
    slide.max_force, twist.max_force = force, force * size_mm / 3
    return slide, twist
