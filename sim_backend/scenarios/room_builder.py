"""Build the room of a scenario step by step: pictures, boxes, walls, people and events; and its mission."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Any

from sim_backend.bundled import PICTURES
from sim_backend.plane import Point, on_map
from sim_backend.scenarios.conditions import Conditions
from sim_backend.scenarios.floor_plan import FloorPlan, Goal, Obstacle
from sim_backend.world.placement import misplaced, outline_of_picture, outline_of_wall
from sim_backend.world.world_file import Robot, WorldFile

ROBOT = Robot(start_mm=(0.0, 0.0))
"""The world file's default robot."""
ROBOT_RADIUS_MM = ROBOT.radius_mm
PRINT_MM, PRINT_FOUND_MM = (105.0, 148.0), 2600.0
"""Size of an A6 print, and how far away geometric vision finds half of them: large rooms have places beyond that."""
LOW_BOX_MM, TALL_BOX_MM = (100.0, 150.0), (350.0, 800.0)
"""Heights of boxes that stop the robot but do not block the view, and of boxes that do both."""
STAND_HEIGHT_MM = 200.0
"""Height of a picture's centre above the floor: that of the camera."""
CLEARANCE_MM = 60.0
"""Clearance beside the robot that a path to each target must have."""
HEAD_START_MM = 800.0
"""Smallest distance from the start to a target."""
FREE_START_MM = 30.0
"""Clearance beside the robot at the start."""
TARGETS_APART_MM = 1200.0
"""Smallest distance between two targets near walls."""
START_MARGIN_MM = 300.0
"""Smallest distance from the middle of the robot to the room's walls at the start."""
AT_WALL_MM, AT_WALL_DEG = (60.0, 150.0), 20.0
"""Distances of a print from the wall that it hangs at, and the largest angle between the two."""
INWARD_DEG = (0, 90, 180, 270)
"""Directions from the left, upper, right and lower wall of a rectangle into it."""
CRUISE_MM_S = 200.0
"""The robot's cruising speed, the same for all profiles."""


Range = tuple[float, float]


@dataclass
class RoomBuilder:
    """The tables of a world file under construction.

    Attributes:
        random: The only source of randomness.
        size_mm: Size of the room.
        start_mm: The robot's start.
        heading_deg: Its heading at the start.
        targets: Names of the targets, in the mission's order.
        pictures: Tables of pictures, by the picture's name.
        boxes: Tables of boxes.
        walls: Tables of inner walls.
        people: Tables of people who can enter.
        events: Tables of events.
        tables: Further tables of the world file, by name.
        robot: Further entries of the robot's table.
        conditions: Those outside the world file.
    """

    random: Random
    size_mm: tuple[float, float]
    start_mm: Point = (0.0, 0.0)
    heading_deg: float = 0.0
    targets: tuple[str, ...] = ("lena", "rilakkuma")
    pictures: dict[str, dict[str, Any]] = field(default_factory=dict)
    boxes: list[dict[str, Any]] = field(default_factory=list)
    walls: list[dict[str, Any]] = field(default_factory=list)
    people: list[dict[str, Any]] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)
    tables: dict[str, Any] = field(default_factory=dict)
    robot: dict[str, Any] = field(default_factory=dict)
    conditions: Conditions = field(default_factory=Conditions)

    def between(self, low: float, high: float) -> float:
        """Draw a uniformly distributed number, rounded to tenths to keep files readable."""
        return round(self.random.uniform(low, high), 1)

    def place(self, margin_mm: float) -> Point:
        """Draw a point in the room, at least `margin_mm` from its walls."""
        width, depth = self.size_mm
        return self.between(margin_mm, width - margin_mm), self.between(margin_mm, depth - margin_mm)

    def place_at_wall(self, corner_mm: float = 600.0, tilt_deg: float = AT_WALL_DEG) -> tuple[Point, float]:
        """Draw a point near one of the walls, and a direction into the room, degrees."""
        inward = self.random.choice(INWARD_DEG)
        at = self.place_before_wall((0.0, 0.0), self.size_mm, inward, self.between(*AT_WALL_MM), corner_mm)
        return at, inward + self.between(-tilt_deg, tilt_deg)

    def place_before_wall(
        self, low_mm: Point, high_mm: Point, inward_deg: int, out_mm: float, corner_mm: float
    ) -> Point:
        """Draw a point beside a wall of a rectangle.

        Args:
            low_mm: The rectangle's corner nearest to the map's origin.
            high_mm: The opposite corner.
            inward_deg: The direction from the wall into the rectangle, one of `INWARD_DEG`.
            out_mm: How far the point is from the wall.
            corner_mm: Its smallest distance from the adjacent walls.
        """
        (x0, y0), (x1, y1) = low_mm, high_mm
        if inward_deg in (0, 180):
            return x0 + out_mm if inward_deg == 0 else x1 - out_mm, self.between(y0 + corner_mm, y1 - corner_mm)
        return self.between(x0 + corner_mm, x1 - corner_mm), y0 + out_mm if inward_deg == 90 else y1 - out_mm

    def add_picture(self, name: str, at_mm: Point, facing_deg: float, **more: object) -> None:
        """Add a print on a stand."""
        self.pictures[name] = {
            "name": name,
            "at_mm": at_mm,
            "facing_deg": facing_deg,
            "size_mm": PRINT_MM,
            "centre_height_mm": STAND_HEIGHT_MM,
            **more,
        }

    def add_box(self, name: str, at_mm: Point, size_mm: tuple[float, float], height_mm: float, **more: object) -> None:
        """Add a box; `more` has further keys of its table, as for the methods below."""
        self.boxes.append({"name": name, "at_mm": at_mm, "size_mm": size_mm, "height_mm": height_mm, **more})

    def add_legs(
        self,
        of: str,
        at_mm: Point,
        facing_deg: float,
        size_mm: tuple[float, float],
        leg_mm: float,
        height_mm: float,
        **more: object,
    ) -> None:
        """Add four legs, `leg_mm` thick, of a piece of furniture; `size_mm` is measured between their centres."""
        for leg, (along, aside) in enumerate([(-1, -1), (-1, 1), (1, -1), (1, 1)]):
            side = point_from(at_mm, facing_deg, along * size_mm[0] / 2)
            place = point_from(side, facing_deg + 90.0, aside * size_mm[1] / 2)
            self.add_box(f"leg {leg} of {of}", place, (leg_mm, leg_mm), height_mm, facing_deg=facing_deg, **more)

    def add_wall(self, from_mm: Point, to_mm: Point, **more: object) -> None:
        """Add an inner wall."""
        self.walls.append({"from_mm": from_mm, "to_mm": to_mm, **more})

    def add_person(self, name: str, enters_from_mm: Point, **more: object) -> None:
        """Add a person, who comes and goes by events."""
        self.people.append({"name": name, "enters_from_mm": enters_from_mm, **more})

    def add_event(self, name: str, when: Mapping[str, object], **more: object) -> None:
        """Add an event."""
        self.events.append({"name": name, "when": when, **more})

    def add_patrol(
        self, name: str, start_mm: Point, end_mm: Point, *, pause_s: Range, radius_mm: Range, speed_mm_s: Range
    ) -> None:
        """Add a person who walks to and fro between two places, with a size and a speed drawn from these ranges."""
        person = {"radius_mm": self.between(*radius_mm), "speed_mm_s": self.between(*speed_mm_s)}
        self.add_person(name, start_mm, **person)
        when = {"at_s": 0, "delay_s": pause_s}
        self.add_event(f"{name} walks", when, times=0, person=name, to_mm=end_mm, stays_s=pause_s)

    def is_apart(self, at_mm: Point, apart_mm: float) -> bool:
        """Return whether a point is at least this far from all pictures."""
        return all(math.dist(at_mm, picture["at_mm"]) >= apart_mm for picture in self.pictures.values())

    def hang_targets(self, corner_mm: float = 600.0, beyond_x_mm: float = 0.0) -> None:
        """Add the targets near walls and to the right of `beyond_x_mm`, at least `TARGETS_APART_MM` from each other."""
        for target in self.targets:
            while True:
                at, facing = self.place_at_wall(corner_mm)
                if at[0] > beyond_x_mm and self.is_apart(at, TARGETS_APART_MM):
                    self.add_picture(target, at, facing)
                    break

    def put_robot(self, far_mm: float = 1300.0) -> None:
        """Draw the robot's start, at least `far_mm` from the targets if a hundred tries find such a place."""
        self.heading_deg = self.between(0.0, 360.0)
        for _ in range(100):
            self.start_mm = self.place(START_MARGIN_MM)
            if self.is_apart(self.start_mm, far_mm):
                return

    def plan(self) -> FloorPlan:
        """Return the floor plan at the start."""
        world = self.world("")
        boxes = {box.name: (box.at_mm, box.facing_deg) for box in world.boxes if box.present}
        pictures = {picture.name: (picture.at_mm, picture.facing_deg) for picture in world.pictures}
        return FloorPlan(world.floor.size_mm, tuple(obstacles(world, boxes, pictures)), world.camera)

    def solvable(self) -> bool:
        """Return whether the start is free and away from the targets, and each target is visible and can be reached."""
        plan = self.plan()
        radius_mm = ROBOT_RADIUS_MM + CLEARANCE_MM
        wanted = [self.pictures[name] for name in self.targets if name in self.pictures]
        goals = [
            Goal(picture["name"], picture["at_mm"], picture["facing_deg"], picture["centre_height_mm"])
            for picture in wanted
        ]
        return (
            plan.is_free(self.start_mm, ROBOT_RADIUS_MM + FREE_START_MM)
            and all(math.dist(self.start_mm, goal.at_mm) >= HEAD_START_MM for goal in goals)
            and not any(misplaced(self.world("")))
            and plan.reachable(self.start_mm, goals, radius_mm)
        )

    def world(self, title: str) -> WorldFile:
        """Return the world file of this room."""
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

    def mission(self, title: str) -> dict[str, Any]:
        """Return the tables of the mission's file."""
        return {
            "mission": {"name": title, "targets": list(self.targets), "time_limit_s": self.conditions.time_limit_s},
            **{profile: {"cruise_mm_s": CRUISE_MM_S} for profile in ("thesis", "adaptive")},
            "target": {
                name: {
                    "detector": "picture",
                    "pictures": [str(PICTURES / f"{name}.png")],
                    "height_mm": self.pictures.get(name, {"size_mm": PRINT_MM})["size_mm"][1],
                }
                for name in self.targets
            },
            "robot": dict(self.conditions.robot),
        }


RoomGenerator = Callable[[Random], RoomBuilder]
"""Generates the room of a class, and its other conditions."""

Pose = tuple[Point, float]
"""Middle of an object, and its facing in degrees."""


def point_from(at_mm: Point, direction_deg: float, distance_mm: float, aside_mm: float = 0.0) -> Point:
    """Return the point ahead in a direction and aside to its right, rounded to tenths to keep files readable."""
    x, y = on_map(at_mm, math.radians(direction_deg), distance_mm, aside_mm)
    return round(x, 1), round(y, 1)


def obstacles(world: WorldFile, boxes: Mapping[str, Pose], pictures: Mapping[str, Pose]) -> Iterator[Obstacle]:
    """Yield the obstacles of a world file except for people.

    Args:
        world: The world file.
        boxes: Where the boxes are that are present, by name.
        pictures: Where the pictures are.
    """
    for i, wall in enumerate(world.walls):
        line = outline_of_wall(wall, f"wall {i}")
        length = (line.size_mm[0], 0.0)  # with rounded ends, unlike the outline
        yield Obstacle(line.what, line.at_mm, length, line.facing_deg, wall.thickness_mm / 2, wall.height_mm)
    for box in world.boxes:
        if box.name in boxes:
            at_mm, facing_deg = boxes[box.name]
            yield Obstacle(box.name, at_mm, box.size_mm, facing_deg, 0.0, box.height_mm)
    for picture in world.pictures:
        if picture.name in pictures:
            at_mm, facing_deg = pictures[picture.name]
            board = outline_of_picture(picture)
            yield Obstacle(picture.name, at_mm, board.size_mm, facing_deg, 0.0, board.height_mm)
