"""Build the room of a scenario step by step: pictures, boxes, walls, people and events."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from random import Random
from typing import Any

from sim_backend.world.world_file import Box, Picture, Wall, WorldFile

from .floor_plan import FloorPlan, Goal, Obstacle, Point

ROBOT_RADIUS_MM = 115.0
"""Of the world file's default robot."""
PRINT_MM, PRINT_FOUND_MM = (105.0, 148.0), 3200.0
"""An A6 print, and from how far the picture detector finds it: a room has places from which it cannot be seen."""
LOW_BOX_MM, TALL_BOX_MM = (100.0, 150.0), (350.0, 800.0)
"""Heights of boxes that stop the robot and not the view, and of those that stop both."""
STAND_MM = 10.0
"""Thickness of a picture on its stand."""
STAND_HEIGHT_MM = 200.0
"""Middle of a picture above the floor: as high as the camera."""
ELBOW_MM = 60.0
"""Room a way of the scenario must leave beside the robot."""
HEAD_START_MM = 800.0
"""No target is nearer to the start."""
FREE_START_MM = 30.0
"""Room beside the robot at the start."""


@dataclass
class RoomBuilder:
    """The tables of a world file under construction.

    Attributes:
        random: The only source of randomness.
        size_mm: Of the room.
        start_mm: Where the robot starts.
        heading_deg: Where it looks then.
        first: The target that is looked for first; the other one is looked for second.
        second: See `first`.
        pictures: Tables of the world file, by the picture's name.
        boxes: Tables of the world file, as the next three.
        walls: Inner walls.
        people: Who can enter.
        events: What happens, and when.
        tables: Further tables of the world file, by name.
        robot: Further entries of its table of the robot.
    """

    random: Random
    size_mm: tuple[float, float]
    start_mm: Point = (0.0, 0.0)
    heading_deg: float = 0.0
    first: str = "lena"
    second: str = "rilakkuma"
    pictures: dict[str, dict[str, Any]] = field(default_factory=dict)
    boxes: list[dict[str, Any]] = field(default_factory=list)
    walls: list[dict[str, Any]] = field(default_factory=list)
    people: list[dict[str, Any]] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)
    tables: dict[str, Any] = field(default_factory=dict)
    robot: dict[str, Any] = field(default_factory=dict)

    def between(self, low: float, high: float) -> float:
        """A number drawn evenly, in whole tenths: files are easier to read so."""
        return round(self.random.uniform(low, high), 1)

    def place(self, margin_mm: float) -> Point:
        """Somewhere in the room."""
        width, depth = self.size_mm
        return self.between(margin_mm, width - margin_mm), self.between(margin_mm, depth - margin_mm)

    def place_at_wall(self, corner_mm: float = 600.0, tilt_deg: float = 20.0) -> tuple[Point, float]:
        """A place at one of the walls, and a direction into the room, degrees."""
        width, depth = self.size_mm
        inward = self.random.choice((0, 90, 180, 270))
        out_mm = self.between(60.0, 150.0)
        along = self.between(corner_mm, (depth if inward in (0, 180) else width) - corner_mm)
        at = {
            0: (out_mm, along),
            90: (along, out_mm),
            180: (width - out_mm, along),
            270: (along, depth - out_mm),
        }[inward]
        return at, inward + self.between(-tilt_deg, tilt_deg)

    def add_picture(self, name: str, at_mm: Point, facing_deg: float, **more: Any) -> None:  # noqa: ANN401 - tables of a world file
        """Hang a print on a stand."""
        self.pictures[name] = {
            "name": name,
            "at_mm": at_mm,
            "facing_deg": facing_deg,
            "size_mm": PRINT_MM,
            "centre_height_mm": STAND_HEIGHT_MM,
            **more,
        }

    def hang_targets(self, apart_mm: float = 1200.0, corner_mm: float = 600.0) -> None:
        """Both targets at walls."""
        at, facing = self.place_at_wall(corner_mm)
        self.add_picture(self.first, at, facing)
        while True:
            other, facing = self.place_at_wall(corner_mm)
            if math.dist(at, other) >= apart_mm:
                self.add_picture(self.second, other, facing)
                return

    def put_robot(self, far_mm: float = 1300.0, margin_mm: float = 300.0) -> None:
        """The robot somewhere, at least `far_mm` from the targets if such a place is found in a hundred tries."""
        self.heading_deg = self.between(0.0, 360.0)
        targets = [picture["at_mm"] for picture in self.pictures.values()]
        for _ in range(100):
            self.start_mm = self.place(margin_mm)
            if all(math.dist(self.start_mm, at) >= far_mm for at in targets):
                return

    def plan(self) -> FloorPlan:
        """What stands there at the start."""
        world = self.world("")
        return FloorPlan(world.floor.size_mm, tuple(standing(world)))

    def sound(self) -> bool:
        """Whether a robot can start there away from the targets, and reach each one that is there."""
        plan = self.plan()
        radius_mm = ROBOT_RADIUS_MM + ELBOW_MM
        wanted = [self.pictures[name] for name in (self.first, self.second) if name in self.pictures]
        goals = [Goal(picture["name"], picture["at_mm"], picture["facing_deg"]) for picture in wanted]
        return (
            plan.passable(self.start_mm, self.start_mm, ROBOT_RADIUS_MM + FREE_START_MM)
            and all(math.dist(self.start_mm, goal.at_mm) >= HEAD_START_MM for goal in goals)
            and all(plan.way(self.start_mm, goal, radius_mm) is not None for goal in goals)
        )

    def world(self, title: str) -> WorldFile:
        """The world file of it."""
        return WorldFile.model_validate(
            {
                "title": title,
                "floor": {"size_mm": self.size_mm},
                "robot": {"start_mm": self.start_mm, "heading_deg": self.heading_deg, **self.robot},
                "ultrasonic": {"noise_mm": 10.0, "dropout": 0.03},
                "pictures": list(self.pictures.values()),
                "boxes": self.boxes,
                "walls": self.walls,
                "people": self.people,
                "events": self.events,
                **self.tables,
            }
        )


def standing(world: WorldFile) -> Iterable[Obstacle]:
    """All obstacles of a world file that are present at the start."""
    yield from (wall_obstacle(wall, i) for i, wall in enumerate(world.walls))
    yield from (box_obstacle(box, box.at_mm, box.facing_deg) for box in world.boxes if box.present)
    yield from (picture_obstacle(picture, picture.at_mm, picture.facing_deg) for picture in world.pictures)


def wall_obstacle(wall: Wall, number: int) -> Obstacle:
    """An inner wall."""
    (x0, y0), (x1, y1) = wall.from_mm, wall.to_mm
    facing = math.degrees(math.atan2(y1 - y0, x1 - x0))
    size = (math.hypot(x1 - x0, y1 - y0), 0.0)
    return Obstacle(
        f"wall {number}", ((x0 + x1) / 2, (y0 + y1) / 2), size, facing, wall.thickness_mm / 2, wall.height_mm
    )


def box_obstacle(box: Box, at_mm: Point, facing_deg: float) -> Obstacle:
    """A box, where it is now."""
    return Obstacle(box.name, at_mm, box.size_mm, facing_deg, 0.0, box.height_mm)


def picture_obstacle(picture: Picture, at_mm: Point, facing_deg: float) -> Obstacle:
    """A picture's stand, where it is now."""
    height_mm = picture.centre_height_mm + picture.size_mm[1] / 2
    return Obstacle(picture.name, at_mm, (STAND_MM, picture.size_mm[0]), facing_deg, 0.0, height_mm)
