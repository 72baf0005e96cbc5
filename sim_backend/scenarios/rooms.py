"""Rooms that differ in their furniture."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from sim_backend.scenarios.room_builder import LOW_BOX_MM, ROBOT_RADIUS_MM, TALL_BOX_MM, RoomBuilder, RoomGenerator


def room(
    random: Random, low_mm: float = 2200.0, high_mm: float = 3500.0, targets: Sequence[str] = ("lena", "rilakkuma")
) -> RoomBuilder:
    """Generate an empty room of random size, with the targets in random order."""
    size = (round(random.uniform(low_mm, high_mm)), round(random.uniform(low_mm, high_mm)))
    return RoomBuilder(random, size, targets=tuple(random.sample(targets, len(targets))))


def furnished(
    random: Random, low_mm: float = 2200.0, high_mm: float = 3500.0, targets: Sequence[str] = ("lena", "rilakkuma")
) -> RoomBuilder:
    """Generate a room with the targets near its walls and the robot away from them."""
    builder = room(random, low_mm, high_mm, targets)
    builder.hang_targets()
    builder.put_robot()
    return builder


def _far(random: Random) -> RoomBuilder:
    builder = room(random, 4000.0, 6000.0)
    builder.hang_targets()
    builder.put_robot(far_mm=3300.0)
    return builder


def _clutter(random: Random) -> RoomBuilder:
    builder = furnished(random, 2800.0, 3800.0)
    add_boxes(builder, random.randint(4, 8))
    return builder


def add_boxes(builder: RoomBuilder, number: int) -> None:
    """Add boxes anywhere in the room, some of them lower than the camera."""
    for i in range(number):
        low = builder.random.random() < 0.3
        builder.add_box(
            f"box{i}",
            builder.place(200.0),
            (builder.between(200, 700), builder.between(200, 700)),
            builder.between(*(LOW_BOX_MM if low else TALL_BOX_MM)),
            facing_deg=builder.between(0, 90),
        )


def _absent(random: Random) -> RoomBuilder:
    builder = furnished(random)
    del builder.pictures[builder.targets[0]]
    return builder


def _wall_start(random: Random) -> RoomBuilder:
    builder = furnished(random)
    (x, y), _ = builder.place_at_wall(corner_mm=400.0)
    inset = ROBOT_RADIUS_MM + 50.0
    width, depth = builder.size_mm
    x, y = builder.start_mm = min(max(x, inset), width - inset), min(max(y, inset), depth - inset)
    walls = {180: x, 0: width - x, 270: y, 90: depth - y}
    builder.heading_deg = min(walls, key=lambda heading: walls[heading]) + builder.between(-30, 30)
    return builder


def _narrow_door(random: Random) -> RoomBuilder:
    builder = room(random, 2600.0, 3600.0)
    width, depth = builder.size_mm = (builder.size_mm[0] + 800.0, builder.size_mm[1])
    x, middle, gap = builder.between(0.42, 0.58) * width, builder.between(600, depth - 600), builder.between(420, 550)
    builder.add_wall((x, 0.0), (x, middle - gap / 2))
    builder.add_wall((x, middle + gap / 2), (x, depth))
    while True:
        builder.pictures.clear()
        builder.hang_targets()
        sides = [picture["at_mm"][0] - x for picture in builder.pictures.values()]
        if all(abs(side) > 400 for side in sides) and any(side > 0 for side in sides):
            break
    while True:
        builder.put_robot(far_mm=1000.0)
        if builder.start_mm[0] < x - 300:
            return builder


ROOMS: dict[str, RoomGenerator] = {
    "open": furnished,
    "far": _far,
    "clutter": _clutter,
    "absent": _absent,
    "wall_start": _wall_start,
    "narrow_door": _narrow_door,
}
