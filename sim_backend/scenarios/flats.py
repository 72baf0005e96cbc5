"""Flats: rooms on both sides of a corridor, each with a door, furnished or not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from sim_backend.plane import Point
from sim_backend.scenarios.room_builder import AT_WALL_DEG, AT_WALL_MM, INWARD_DEG, LOW_BOX_MM, TALL_BOX_MM, RoomBuilder

CORRIDOR_MM = (1000.0, 1300.0)
ROOM_WIDTH_MM, ROOM_DEPTH_MM = (2000.0, 3000.0), (2000.0, 3000.0)
DOOR_MM = (700.0, 800.0)
"""Width of a door. Inner doors of flats are 0.7 to 0.8 m wide in the clear."""
CORNER_MM = 300.0
"""Smallest distance of a door from the room's corners."""
DOOR_KEPT_MM = 900.0
"""Targets and the middle of furniture keep this distance from the middle of a door."""
FLAT_TARGETS_APART_MM = 900.0
"""Smallest distance between two targets."""
TARGET_KEPT_MM = 500.0
"""Furniture keeps this distance from a target."""
PLACES = 20
"""Number of places to try for a piece of furniture."""
FURNITURE_MM = {"sofa": (700.0, 1500.0), "table": (500.0, 900.0), "cupboard": (350.0, 900.0), "crate": (250.0, 400.0)}
"""Depth and width of the furniture."""


@dataclass(frozen=True, slots=True)
class FlatRoom:
    """A room of a flat.

    Attributes:
        low_mm: Its corner nearest to the map's origin.
        high_mm: The opposite corner.
        door_mm: Middle of its door; None for the corridor.
    """

    low_mm: Point
    high_mm: Point
    door_mm: Point | None = None

    def place(self, builder: RoomBuilder, margin_mm: float) -> Point:
        """Draw a point in it, at least `margin_mm` from its walls."""
        (x0, y0), (x1, y1) = self.low_mm, self.high_mm
        return builder.between(x0 + margin_mm, x1 - margin_mm), builder.between(y0 + margin_mm, y1 - margin_mm)

    @property
    def shorter_mm(self) -> float:
        """Length of its shorter side."""
        return min(high - low for low, high in zip(self.low_mm, self.high_mm, strict=True))

    def place_at_wall(self, builder: RoomBuilder, out_mm: float, corner_mm: float) -> tuple[Point, float]:
        """Draw a point `out_mm` from one of its walls and away from its door, and the direction into the room."""
        while True:
            inward = builder.random.choice(INWARD_DEG)
            at = builder.place_before_wall(self.low_mm, self.high_mm, inward, out_mm, corner_mm)
            if self.door_mm is None or math.dist(at, self.door_mm) >= DOOR_KEPT_MM:
                return at, float(inward)


@dataclass(frozen=True, slots=True)
class Flat:
    """A flat without furniture.

    Attributes:
        builder: Has its walls.
        rooms: The rooms with a door.
        corridor: Where the doors lead.
    """

    builder: RoomBuilder
    rooms: Sequence[FlatRoom]
    corridor: FlatRoom


def generate_flat(random: Random, rooms: int, targets: Sequence[str]) -> Flat:
    """Generate a flat of an even number of rooms, half of them on each side of the corridor.

    Args:
        random: The only source of randomness.
        rooms: Their number.
        targets: Names of the targets; their order is random.
    """
    widths = [[random.uniform(*ROOM_WIDTH_MM) for _ in range(rooms // 2)] for _ in range(2)]
    width = round(sum(map(sum, widths)) / 2)
    upper, corridor, lower = (round(random.uniform(*ends)) for ends in (ROOM_DEPTH_MM, CORRIDOR_MM, ROOM_DEPTH_MM))
    order = tuple(random.sample(targets, len(targets)))
    builder = RoomBuilder(random, (width, upper + corridor + lower), targets=order)
    sides = ((0.0, float(upper)), (float(upper + corridor), float(upper + corridor + lower)))
    flat_rooms = [
        room
        for (low, high), shares in zip(sides, widths, strict=True)
        for room in _side(builder, low, high, [share * width / sum(shares) for share in shares])
    ]
    return Flat(builder, flat_rooms, FlatRoom((0.0, float(upper)), (float(width), float(upper + corridor))))


def _side(builder: RoomBuilder, low: float, high: float, widths: Sequence[float]) -> list[FlatRoom]:
    """Add the walls of the rooms on one side of the corridor, which is at its inner edge."""
    inner = high if low == 0.0 else low
    rooms, x0 = [], 0.0
    for number, width in enumerate(widths):
        x1 = round(x0 + width, 1)
        gap = builder.between(*DOOR_MM)
        door = builder.between(x0 + CORNER_MM + gap / 2, x1 - CORNER_MM - gap / 2)
        builder.add_wall((x0, inner), (round(door - gap / 2, 1), inner))
        builder.add_wall((round(door + gap / 2, 1), inner), (x1, inner))
        if number:
            builder.add_wall((x0, low), (x0, high))
        rooms.append(FlatRoom((x0, low), (x1, high), (door, inner)))
        x0 = x1
    return rooms


def furnish(flat: Flat, pieces: tuple[int, int] = (0, 0)) -> RoomBuilder:
    """Furnish each room, hang each target in a room of its own, and put the robot into the corridor or a free room.

    Args:
        flat: Without furniture.
        pieces: Least and greatest number of pieces of furniture in a room.
    """
    builder = flat.builder
    rooms = builder.random.sample(flat.rooms, len(flat.rooms))
    hung = rooms[: len(builder.targets)]
    for target, room in zip(builder.targets, hung, strict=True):
        while True:  # a thin wall may be all that is between two targets
            at, inward = room.place_at_wall(builder, builder.between(*AT_WALL_MM), 400.0)
            if builder.is_apart(at, FLAT_TARGETS_APART_MM):
                break
        builder.add_picture(target, at, inward + builder.between(-AT_WALL_DEG, AT_WALL_DEG))
    for number, room in enumerate(flat.rooms):
        for piece in range(builder.random.randint(*pieces)):
            _add_furniture(builder, room, f"{number}.{piece}")
    start = builder.random.choice([flat.corridor, *rooms[len(hung) :]])
    builder.start_mm, builder.heading_deg = start.place(builder, 300.0), builder.between(0.0, 360.0)
    return builder


def _add_furniture(builder: RoomBuilder, room: FlatRoom, number: str) -> None:
    """Add a piece of furniture at a wall, if there is space; some of it is lower than the camera."""
    kind = builder.random.choice(list(FURNITURE_MM))
    depth, width = (builder.between(0.8 * side, 1.2 * side) for side in FURNITURE_MM[kind])
    targets = [picture["at_mm"] for picture in builder.pictures.values()]
    for _ in range(PLACES):
        at, inward = room.place_at_wall(builder, depth / 2 + 20.0, width / 2 + 20.0)
        if all(math.dist(at, target) >= TARGET_KEPT_MM + width / 2 for target in targets):
            break
    else:
        return
    low = builder.random.random() < 0.2
    height_mm = builder.between(*(LOW_BOX_MM if low else TALL_BOX_MM))
    middle = round(at[0], 1), round(at[1], 1)
    builder.add_box(f"{kind} {number}", middle, (depth, width), height_mm, facing_deg=inward)
