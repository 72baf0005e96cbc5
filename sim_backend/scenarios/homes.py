"""Homes: one to four rooms with what stands and lies about where people live.

Sonar and camera each miss some of it: legs, soft furniture, low toys, wood on a wooden floor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

import numpy as np

from sim_backend.plane import Point
from sim_backend.scenarios.conditions import Conditions
from sim_backend.scenarios.flats import CORNER_MM, FLAT_TARGETS_APART_MM, FlatRoom
from sim_backend.scenarios.floor_plan import Obstacle
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM, Range, RoomBuilder, point_from

WIDTH_MM, DEPTH_MM = (4500.0, 8500.0), (3800.0, 6500.0)
DIVIDED_MM = 3600.0
"""Rooms shorter than this are not divided."""
DOOR_MM = (700.0, 900.0)
AJAR_DEG = (60.0, 140.0)
"""Angles at which the leaf of a door stands open."""
WALLS = ("wall", "wallpaper", "bricks")
PRINTS_MM = ((105.0, 148.0), (148.0, 210.0), (210.0, 297.0), (210.0, 297.0))
"""A6, A5, and A4 twice as often."""
HANGS_MM = (200.0, 300.0, 400.0)
"""Heights of the centre of a print that does not stand on the floor."""
DOOR_KEPT_MM = 450.0
"""Furniture keeps this distance from the middle of a door."""
PRINT_KEPT_MM = 350.0
"""The floor in front of a print is free in a circle with this radius."""
APART_MM = 60.0
"""Smallest gap between two pieces of furniture."""
WALL_KEPT_MM = 150.0
"""Things that do not stand against a wall keep this distance from it."""
PLACES = 40
"""Number of places to try for each piece."""
TIME_LIMIT_S = 240.0


@dataclass(frozen=True, slots=True)
class Piece:
    """A kind of furniture that stands against walls. All sizes are guesses.

    Attributes:
        name: What it is.
        number: Smallest and largest number of them.
        size_mm: Depth and width.
        heights_mm: The heights to choose from.
        textures: The textures to choose from.
        soft: Share of them that absorbs ultrasound.
    """

    name: str
    number: tuple[int, int]
    size_mm: tuple[float, float]
    heights_mm: Sequence[float]
    textures: Sequence[str]
    soft: float = 0.0


PIECES = (
    Piece("sofa", (1, 2), (850.0, 1700.0), (750.0,), ("red_box", "blue_box", "green_box", "person_green"), soft=0.5),
    Piece("bed", (0, 1), (2000.0, 1400.0), (450.0,), ("carpet",), soft=1.0),
    Piece("shelf", (1, 3), (320.0, 1000.0), (1600.0,), ("wood",)),
    Piece("plant", (0, 2), (250.0, 250.0), (300.0, 600.0), ("green_box", "crate", "carton")),
)
TABLE_MM, TABLE_LEG_MM, TABLE_HEIGHT_MM = (1200.0, 750.0), 60.0, 720.0
CHAIR_MM, CHAIR_LEG_MM, CHAIR_HEIGHT_MM = (380.0, 380.0), 40.0, 440.0
LAMP_MM, LAMP_HEIGHT_MM = (40.0, 40.0), 1500.0
TOY_MM, TOY_HEIGHTS_MM = ((80.0, 250.0), (80.0, 200.0)), (60.0, 110.0, 180.0)
TOYS = ("red_box", "yellow_box", "blue_box", "carton")
FLATMATE: dict[str, Range] = {"pause_s": (4, 20), "radius_mm": (150, 200), "speed_mm_s": (400, 900)}


def generate_home(random: Random, names: Sequence[str]) -> RoomBuilder:
    """Generate a home with two or three of the targets in it.

    Args:
        random: The only source of randomness.
        names: Names of the targets to choose from.
    """
    size = round(random.uniform(*WIDTH_MM)), round(random.uniform(*DEPTH_MM))
    builder = RoomBuilder(random, size, targets=tuple(random.sample(names, random.choice((2, 3)))))
    builder.conditions = Conditions(time_limit_s=TIME_LIMIT_S)
    home = _Home(builder)
    home.divide(FlatRoom((0.0, 0.0), builder.size_mm), random.choice((0, 1, 2, 2)))
    home.hang_targets()
    for piece in PIECES:
        for number in range(random.randint(*piece.number)):
            home.add_piece(piece, number)
    home.add_things()
    if random.random() < 0.5:
        home.add_flatmate()
    if random.random() < 0.5:
        builder.tables["camera"] = {"latency_s": builder.between(0.05, 0.3), "fps": random.choice((8, 10, 15))}
    builder.start_mm = home.place((2 * ROBOT_RADIUS_MM, 2 * ROBOT_RADIUS_MM)) or home.rooms[0].place(builder, 300.0)
    builder.heading_deg = builder.between(0.0, 360.0)
    return builder


@dataclass(slots=True)
class _Home:
    """A home under construction.

    Attributes:
        builder: Has its walls and furniture.
        rooms: Its rooms.
        kept: Circles that further furniture does not reach into: middle and radius, mm.
    """

    builder: RoomBuilder
    rooms: list[FlatRoom] = field(default_factory=list)
    kept: list[tuple[Point, float]] = field(default_factory=list)

    def divide(self, room: FlatRoom, times: int) -> None:
        """Divide a room across its longer side, and its halves again, and add the rooms that remain."""
        (x0, y0), (x1, y1) = room.low_mm, room.high_mm
        width, depth, share = x1 - x0, y1 - y0, self.builder.random.uniform(0.38, 0.62)
        if not times or max(width, depth) < DIVIDED_MM:
            self.rooms.append(room)
        elif width >= depth:
            x = round(x0 + share * width, 1)
            self._add_partition((x, y0), 90.0, depth)
            self.divide(FlatRoom((x0, y0), (x, y1)), times - 1)
            self.divide(FlatRoom((x, y0), (x1, y1)), times - 1)
        else:
            y = round(y0 + share * depth, 1)
            self._add_partition((x0, y), 0.0, width)
            self.divide(FlatRoom((x0, y0), (x1, y)), times - 1)
            self.divide(FlatRoom((x0, y), (x1, y1)), times - 1)

    def _add_partition(self, start_mm: Point, direction_deg: float, length_mm: float) -> None:
        """Add a wall with a door, whose leaf stands open or was taken out."""
        builder = self.builder
        texture, door = builder.random.choice(WALLS), builder.between(*DOOR_MM)
        middle = builder.between(CORNER_MM + door / 2, length_mm - CORNER_MM - door / 2)
        hinge, latch = (point_from(start_mm, direction_deg, middle + side * door / 2) for side in (-1, 1))
        builder.add_wall(start_mm, hinge, texture=texture, thickness_mm=80.0)
        builder.add_wall(latch, point_from(start_mm, direction_deg, length_mm), texture=texture, thickness_mm=80.0)
        self.kept.append((point_from(start_mm, direction_deg, middle), DOOR_KEPT_MM))
        if builder.random.random() < 0.5:
            leaf_deg = direction_deg + builder.between(*AJAR_DEG) * builder.random.choice((1, -1))
            builder.add_wall(hinge, point_from(hinge, leaf_deg, door - 40.0), texture="wood", thickness_mm=40.0)
            self.kept.append((point_from(hinge, leaf_deg, door / 2), door / 2))

    def hang_targets(self) -> None:
        """Hang the targets on walls, apart from each other."""
        builder = self.builder
        for name in builder.targets:
            while True:
                room, size = builder.random.choice(self.rooms), builder.random.choice(PRINTS_MM)
                at, inward = room.place_at_wall(builder, builder.between(40.0, 120.0), 200.0)
                front = point_from(at, inward, PRINT_KEPT_MM)
                if builder.is_apart(at, FLAT_TARGETS_APART_MM) and self._fits(front, (0.0, 0.0), inward):
                    break
            centre_mm = builder.random.choice((size[1] / 2 + 20.0, *HANGS_MM))
            facing = inward + builder.between(-15.0, 15.0)
            builder.add_picture(name, at, facing, size_mm=size, centre_height_mm=centre_mm)
            self.kept.append((front, PRINT_KEPT_MM))

    def add_piece(self, piece: Piece, number: int) -> None:
        """Add a piece of furniture against a wall, if there is room for it."""
        builder, random, (depth, width) = self.builder, self.builder.random, piece.size_mm
        rooms = [room for room in self.rooms if room.shorter_mm > max(depth, width) + 2 * APART_MM]
        for _ in range(PLACES if rooms else 0):
            out_mm = depth / 2 + builder.between(20.0, APART_MM)
            at, inward = random.choice(rooms).place_at_wall(builder, out_mm, width / 2 + APART_MM)
            if self._fits(at, piece.size_mm, inward):
                break
        else:
            return
        more: dict[str, object] = {"absorbs": True} if random.random() < piece.soft else {}
        look = {"facing_deg": inward, "texture": random.choice(piece.textures)}
        middle, height_mm = (round(at[0], 1), round(at[1], 1)), random.choice(piece.heights_mm)
        builder.add_box(f"{piece.name} {number}", middle, piece.size_mm, height_mm, **look, **more)
        self.kept.append((at, math.hypot(depth, width) / 2 + APART_MM))

    def add_things(self) -> None:
        """Add what stands and lies about away from walls: a table with chairs, a lamp, toys, carpets."""
        builder = self.builder
        random = builder.random
        if random.random() < 0.5 and (at := self.place(TABLE_MM)):
            self._add_table(at)
        if random.random() < 0.5 and (at := self.place(LAMP_MM)):
            builder.add_box("lamp", at, LAMP_MM, LAMP_HEIGHT_MM, texture="wood")
        for number in range(random.randint(0, 3)):
            size = builder.between(*TOY_MM[0]), builder.between(*TOY_MM[1])
            if at := self.place(size):
                look = {"facing_deg": builder.between(0.0, 90.0), "texture": random.choice(TOYS)}
                builder.add_box(f"toy {number}", at, size, random.choice(TOY_HEIGHTS_MM), **look)
        builder.tables["carpets"] = [self._carpet() for _ in range(random.randint(0, 2))]

    def _add_table(self, at_mm: Point) -> None:
        """Add a table with one to three chairs."""
        builder, random = self.builder, self.builder.random
        facing, wood = builder.between(0.0, 90.0), {"texture": "wood"}
        builder.add_legs("table", at_mm, facing, TABLE_MM, TABLE_LEG_MM, TABLE_HEIGHT_MM, **wood)
        for number in range(random.randint(1, 3)):
            place = point_from(at_mm, facing + random.choice((90.0, -90.0)), 560.0, random.choice((-300.0, 300.0)))
            turned = facing + builder.between(-20.0, 20.0)
            builder.add_legs(f"chair {number}", place, turned, CHAIR_MM, CHAIR_LEG_MM, CHAIR_HEIGHT_MM, **wood)

    def _carpet(self) -> dict[str, object]:
        builder = self.builder
        (x0, y0), (x1, y1) = (room := builder.random.choice(self.rooms)).low_mm, room.high_mm
        return {
            "at_mm": (round((x0 + x1) / 2, 1), round((y0 + y1) / 2, 1)),
            "size_mm": (round((x1 - x0) * 0.6, 1), round((y1 - y0) * 0.5, 1)),
            "grip": round(builder.random.uniform(0.6, 1.0), 2),
            "drag_nm": round(builder.random.uniform(0.0, 0.02), 3),
        }

    def add_flatmate(self) -> None:
        """Add a person who walks to and fro between two places."""
        ends = [at for at in (self.place(), self.place()) if at]
        if len(ends) == 2:
            self.builder.add_patrol("flatmate", *ends, **FLATMATE)

    def place(self, size_mm: tuple[float, float] = (0.0, 0.0)) -> Point | None:
        """Draw and keep a place for a thing of this size, away from walls; None if none was found to be free."""
        half = math.hypot(*size_mm) / 2
        rooms = [room for room in self.rooms if room.shorter_mm > 2 * (half + WALL_KEPT_MM)]
        for _ in range(PLACES if rooms else 0):
            at = self.builder.random.choice(rooms).place(self.builder, half + WALL_KEPT_MM)
            if self._fits(at, (2 * half, 2 * half), 0.0):
                self.kept.append((at, half + APART_MM))
                return at
        return None

    def _fits(self, at_mm: Point, size_mm: tuple[float, float], facing_deg: float) -> bool:
        """Return whether a thing stays out of all circles in `kept`."""
        outline = Obstacle("", at_mm, size_mm, facing_deg)
        return all(float(outline.distance_mm(np.array(place))) > radius for place, radius in self.kept)
