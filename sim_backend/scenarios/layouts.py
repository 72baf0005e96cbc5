"""Rooms that are not one rectangle with straight walls: the layouts of the class `layouts`."""

from __future__ import annotations

import math
from itertools import pairwise
from random import Random

from sim_backend.plane import Point, sides_of
from sim_backend.scenarios.flats import CORRIDOR_MM
from sim_backend.scenarios.room_builder import RoomBuilder, point_from
from sim_backend.scenarios.rooms import room

DOOR_MM = 750.0
LEG_MM, TABLE_MM, TABLE_HEIGHT_MM = 60.0, (1100.0, 700.0), 720.0
"""Width of a table's legs, the distances between their middles, and their height. The top is above robot and camera."""
PARTITION_HEIGHTS_MM = (150.0, 900.0, 1300.0)
"""A partition may be lower than the camera."""


def generate_layout(random: Random) -> RoomBuilder:
    """Find two targets where walls are oblique, corridors turn, tables stand on legs, or a door is blocked."""
    return random.choice((_six_walls, _corner, _tables, _open_office, _two_doors))(random)


def _six_walls(random: Random) -> RoomBuilder:
    """Generate a room with six walls, none of them parallel to an axis, and a stool somewhere."""
    builder = room(random, 4400.0, 5000.0)
    (width, depth), radius = builder.size_mm, min(builder.size_mm) / 2 - 100.0
    middle = width / 2, depth / 2
    turn = builder.between(8, 22)
    corners = [point_from(middle, turn + 60.0 * i, radius) for i in range(6)]
    for start, end in sides_of(corners):
        builder.add_wall(start, end)
    for target, side in zip(builder.targets, random.sample(range(6), 2), strict=True):
        outward = turn + 60.0 * side + 30.0
        at = point_from(middle, outward, radius * math.cos(math.radians(30.0)) - builder.between(60, 150))
        builder.add_picture(target, at, outward - 180.0 + builder.between(-20, 20))
    stool = point_from(middle, builder.between(0, 360), builder.between(600, 1200))
    builder.add_box("stool", stool, (350.0, 350.0), 450.0, facing_deg=builder.between(0, 90))
    _start(builder, point_from(middle, builder.between(0, 360), builder.between(0, 800)))
    return builder


def _corner(random: Random) -> RoomBuilder:
    """Generate two corridors that meet at a corner; the second has a niche, which hides a target from the first."""
    builder = room(random, 4500.0, 6000.0)
    (width, depth), across = builder.size_mm, builder.between(*CORRIDOR_MM)
    inner, low = width - across, builder.between(across + 700.0, depth - 1800.0)
    niche = 700.0
    bends = [(0.0, across), (inner, across), (inner, low), (inner - niche, low), (inner - niche, low + 900.0)]
    bends += [(inner, low + 900.0), (inner, depth)]
    for start, end in pairwise(bends):
        builder.add_wall(start, end)
    first, second = builder.targets
    builder.add_picture(first, (inner - niche + 120.0, low + 450.0), builder.between(-15, 15))
    builder.add_picture(
        second, (width - 120.0, builder.between(across, depth - 500.0)), 180.0 + builder.between(-20, 20)
    )
    at = builder.between(1500, inner - 600.0), random.choice((150.0, across - 150.0))
    builder.add_box("bin", at, (220.0, 220.0), 300.0, facing_deg=builder.between(0, 90))
    _start(builder, (600.0, across / 2))
    return builder


def _tables(random: Random) -> RoomBuilder:
    """Generate a dining room: the floor under four tables is free but for their legs and some chairs."""
    builder = room(random, 4200.0, 5600.0)
    width, depth = builder.size_mm
    for table, (x, y) in enumerate([(0.3, 0.28), (0.7, 0.28), (0.3, 0.72), (0.7, 0.72)]):
        at, facing = (width * x, depth * y), builder.between(-20, 20)
        builder.add_legs(f"table {table}", at, facing, TABLE_MM, LEG_MM, TABLE_HEIGHT_MM)
        for chair in range(random.randint(0, 2)):
            place = point_from(at, facing + random.choice((-90.0, 90.0)), 600.0)
            name = f"chair {chair} of table {table}"
            builder.add_box(name, place, (300.0, 300.0), 430.0, facing_deg=builder.between(0, 90))
    builder.hang_targets()
    builder.put_robot()
    return builder


def _open_office(random: Random) -> RoomBuilder:
    """Generate a hall with short partitions at all angles, and sofas that absorb ultrasound; a target stands free."""
    builder = room(random, 5500.0, 7000.0)
    width, depth = builder.size_mm
    for _ in range(5):
        at, facing, half = builder.place(900.0), builder.between(0, 180), builder.between(400, 800)
        ends = point_from(at, facing, -half), point_from(at, facing, half)
        builder.add_wall(*ends, height_mm=random.choice(PARTITION_HEIGHTS_MM))
    for sofa, y in enumerate((400.0, depth - 400.0)):
        at = builder.between(1000, width - 1000.0), y
        builder.add_box(f"sofa {sofa}", at, (1600.0, 700.0), 700.0, absorbs=True)
    at_wall, free = builder.targets
    builder.add_picture(at_wall, *builder.place_at_wall())
    builder.add_picture(free, builder.place(1200.0), builder.between(0, 360))
    builder.put_robot()
    return builder


def _two_doors(random: Random) -> RoomBuilder:
    """Generate two rooms with two doors between them, of which a crate blocks one."""
    builder = room(random, 4400.0, 5600.0)
    width, depth = builder.size_mm
    x = round(width * random.uniform(0.4, 0.6), 1)
    doors = [depth * random.uniform(0.15, 0.35), depth * random.uniform(0.65, 0.85)]
    edges = [0.0, *(door + side * DOOR_MM / 2 for door in doors for side in (-1, 1)), depth]
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        builder.add_wall((x, start), (x, end))
    builder.add_box("crate", (x, random.choice(doors)), (400.0, 550.0), 400.0)
    builder.hang_targets(400.0, beyond_x_mm=x + 300.0)
    _start(builder, (builder.between(400, x - 400.0), builder.between(400, depth - 400.0)))
    return builder


def _start(builder: RoomBuilder, at_mm: Point) -> None:
    builder.start_mm, builder.heading_deg = at_mm, builder.between(0, 360)
