"""Place boxes, such as those of numbers, beside their points, so that none covers another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from nxtdrive.drawing.sheet import Box, Point

DIRECTIONS = 16
NEAREST, STEP = 15.0, 9.0
"""Distance from a point to the edge of its box: the first that is tried, and the steps outwards; pixels."""
COVERED = 6.0
"""A box may be this many pixels farther away for each point of `avoid` that it would cover."""
GAP = 2.0
"""Pixels between boxes."""


def place_boxes(
    points: Sequence[Point], sizes: Sequence[Point], frame: Box, avoid: Sequence[Point] = (), taken: Sequence[Box] = ()
) -> list[Box | None]:
    """Return a box for each point: near it, inside the frame, overlapping neither another box nor `taken`.

    Args:
        points: The points of the boxes; those that come first are placed best.
        sizes: Width and height of each box.
        frame: Where boxes may be.
        avoid: Points that boxes should not cover, if there is room elsewhere.
        taken: Boxes that must not be overlapped.

    Returns:
        The boxes in order; None where there is no room left in the frame.
    """
    # a robot that turns on the spot is in one place a hundred times
    busy = np.unique(np.array([*avoid, *points], np.float64).reshape(-1, 2).round(-1), axis=0)
    placed: list[Box | None] = []
    for point, size in zip(points, sizes, strict=True):
        others = [*taken, *filter(None, placed)]
        placed.append(_nearest(point, size, frame, busy, others) or _anywhere(point, size, frame, others))
    return placed


def overlap(one: Box, other: Box, gap: float = 0.0) -> bool:
    """Return whether two boxes overlap, or are nearer to each other than `gap`."""
    return one[0] < other[2] + gap and other[0] < one[2] + gap and one[1] < other[3] + gap and other[1] < one[3] + gap


def _nearest(point: Point, size: Point, frame: Box, busy: NDArray[np.float64], others: Sequence[Box]) -> Box | None:
    """Return the cheapest box on rings around a point; a box on a ring farther out has to be cheaper to be taken."""
    best, least = None, math.inf
    farthest = math.hypot(frame[2] - frame[0], frame[3] - frame[1])
    for ring in range(math.ceil(farthest / STEP)):
        away = NEAREST + ring * STEP
        if away >= least:
            break
        for box in _ring(point, size, away):
            if _fits(box, frame, others):
                inside = (busy > (box[0], box[1])) & (busy < (box[2], box[3]))
                price = away + COVERED * int(np.count_nonzero(inside.all(axis=1)))
                if price < least:
                    best, least = box, price
    return best


def _ring(point: Point, size: Point, away: float) -> Iterator[Box]:
    width, height = size
    for i in range(DIRECTIONS):
        angle = 2 * math.pi * (i + 0.5) / DIRECTIONS - math.pi / 2
        x = point[0] + (away + width / 2) * math.cos(angle) - width / 2
        y = point[1] + (away + height / 2) * math.sin(angle) - height / 2
        yield x, y, x + width, y + height


def _anywhere(point: Point, size: Point, frame: Box, others: Sequence[Box]) -> Box | None:
    """Return the free box of a raster that is nearest to a point."""
    width, height = size
    columns = np.arange(frame[0], frame[2] - width + 1e-6, width + GAP)
    rows = np.arange(frame[1], frame[3] - height + 1e-6, height + GAP)
    boxes = [(float(x), float(y), float(x) + width, float(y) + height) for x in columns for y in rows]
    free = [box for box in boxes if _fits(box, frame, others)]
    return min(free, key=lambda box: math.dist(point, centre(box)), default=None)


def centre(box: Box) -> Point:
    """Return the middle of a box."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def _fits(box: Box, frame: Box, others: Sequence[Box]) -> bool:
    inside = box[0] >= frame[0] and box[1] >= frame[1] and box[2] <= frame[2] + 1e-6 and box[3] <= frame[3] + 1e-6
    return inside and not any(overlap(box, other, GAP) for other in others)
