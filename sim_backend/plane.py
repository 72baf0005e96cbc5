"""Coordinates and angles on the floor: x to the right of the map, y down, angles clockwise from +x.

An object has two axes of its own: along its facing, and across it, to the right.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Point = tuple[float, float]
Length = TypeVar("Length", float, "NDArray[np.float64]")
"""One length in millimetres, or an array of them."""
Angle = TypeVar("Angle", float, "NDArray[np.float64]")
"""One angle in degrees, or an array of them."""


def along_and_across(x: Length, y: Length, facing_deg: float) -> tuple[Length, Length]:
    """Return a vector on the map in the axes of an object."""
    facing = math.radians(facing_deg)
    cos, sin = math.cos(facing), math.sin(facing)
    return x * cos + y * sin, y * cos - x * sin


def on_map(at_mm: Point, facing_rad: float, along_mm: float, across_mm: float) -> Point:
    """Return the map position of a point that is given in the axes of an object.

    Args:
        at_mm: The object.
        facing_rad: Its facing.
        along_mm: Distance of the point ahead of the object.
        across_mm: Distance to its right.
    """
    cos, sin = math.cos(facing_rad), math.sin(facing_rad)
    return at_mm[0] + along_mm * cos - across_mm * sin, at_mm[1] + along_mm * sin + across_mm * cos


def within(point: Point, at_mm: Point, size_mm: Point, facing_deg: float) -> bool:
    """Return whether a point is in a rectangle around `at_mm`, with `size_mm` along and across its facing."""
    along, across = along_and_across(point[0] - at_mm[0], point[1] - at_mm[1], facing_deg)
    return abs(along) <= size_mm[0] / 2 and abs(across) <= size_mm[1] / 2


def corners_of(at_mm: Point, size_mm: Point, facing_rad: float) -> list[Point]:
    """Return the corners of a rectangle around `at_mm`, with `size_mm` along and across its facing, clockwise.

    Args:
        at_mm: Its middle.
        size_mm: Its sides.
        facing_rad: Its facing.
    """
    along, across = size_mm[0] / 2, size_mm[1] / 2
    offsets = ((along, -across), (along, across), (-along, across), (-along, -across))
    return [on_map(at_mm, facing_rad, *offset) for offset in offsets]


def sides_of(corners: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    """Return both ends of each side of a polygon, in the order of its corners."""
    return pairwise([*corners, corners[0]])


def wrapped_deg(angle_deg: Angle) -> Angle:
    """Return the same angle in -180..180; of an array, that of each element."""
    return (angle_deg + 180.0) % 360.0 - 180.0
