"""Model the true floor: obstacles, lines of sight, and a robot's shortest path to a picture.

Everything is in world coordinates: millimetres, x to the right of the map, y down, angles clockwise from +x.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.plane import Point, along_and_across, wrapped_deg
from sim_backend.world.world_file import Camera

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cell = tuple[int, int]

CELL_MM = 50.0
"""Cell size of the planning grid; paths are smoothed afterwards, so their lengths are more accurate than this."""
SAMPLE_MM = 20.0
"""Distance between the points at which a straight line is checked."""
REACH_MM = 500.0
"""A stop counts if the camera is at most this far from the picture. Source: docs/evaluation.md, success."""
REACH_DEG = 75.0
"""A stop counts within this angle of the picture's normal."""
SAME_PLACE_MM = 1.0
"""Corners closer together than this are merged; also the tolerance of a clearance."""
FAR_FROM_FREE_CELLS = 4
"""A start may be this far from free cells: the grid may take the cell of a robot near an obstacle for occupied."""
NARROW_COST = 4.0
"""Additional cost factor of a cell without any of the preferred clearance."""
SIGHT_SAMPLES = 40
"""Points at which a line of sight is checked."""
_STEPS = [(dx, dy, math.hypot(dx, dy)) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A block on the floor; with `radius_mm` its corners are rounded, and without a size it is a round post.

    Attributes:
        name: Its name.
        at_mm: Its centre.
        size_mm: Along and across its facing; (0, 0) for a round post.
        facing_deg: Direction of its front.
        radius_mm: Added all around, with rounded corners.
        height_mm: Top edge above the floor.
    """

    name: str
    at_mm: Point
    size_mm: tuple[float, float] = (0.0, 0.0)
    facing_deg: float = 0.0
    radius_mm: float = 0.0
    height_mm: float = 1000.0

    @property
    def outer_mm(self) -> float:
        """Radius of the circle around it."""
        return math.hypot(*self.size_mm) / 2 + self.radius_mm

    def distance_mm(self, points: Floats) -> Floats:
        """Return the distance from each of `points`, shape (..., 2), to its edge; 0 inside."""
        x, y = points[..., 0] - self.at_mm[0], points[..., 1] - self.at_mm[1]
        along, across = (np.abs(each) for each in along_and_across(x, y, self.facing_deg))
        beyond = np.maximum(along - self.size_mm[0] / 2, 0.0), np.maximum(across - self.size_mm[1] / 2, 0.0)
        gap = np.hypot(*beyond) - self.radius_mm
        return np.maximum(gap, 0.0)

    def near(self, low: Sequence[float], high: Sequence[float], distance_mm: float) -> bool:
        """Return whether it may come that near to a point of the upright rectangle between two corners."""
        beyond = (max(a - at, at - b, 0.0) for a, at, b in zip(low, self.at_mm, high, strict=True))
        return math.hypot(*beyond) <= self.outer_mm + distance_mm + SAME_PLACE_MM


@dataclass(frozen=True, slots=True)
class Goal:
    """Where a stop in front of a picture counts.

    Attributes:
        name: Of the picture.
        at_mm: Its centre.
        facing_deg: Its normal.
        centre_height_mm: Height of its centre above the floor.
        reach_mm: Largest distance of a stop.
        nearest_mm: Smallest distance of a stop.
        reach_deg: Largest angle off the normal.
    """

    name: str
    at_mm: Point
    facing_deg: float
    centre_height_mm: float = 200.0
    reach_mm: float = REACH_MM
    nearest_mm: float = 0.0
    reach_deg: float = REACH_DEG

    def covers(self, points: Floats) -> Mask:
        """Return which of `points` are near enough and in front; lines of sight are not checked."""
        x, y = points[..., 0] - self.at_mm[0], points[..., 1] - self.at_mm[1]
        distance = np.hypot(x, y)
        off_deg = wrapped_deg(np.degrees(np.arctan2(y, x)) - self.facing_deg)
        covered = (distance <= self.reach_mm) & (distance >= self.nearest_mm) & (np.abs(off_deg) <= self.reach_deg)
        return np.asarray(covered, dtype=np.bool_)


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """A robot's speed and acceleration limits.

    Attributes:
        speed_mm_s: Straight ahead.
        speed_mm_s2: Its acceleration.
        turn_deg_s: On the spot.
        turn_deg_s2: Its acceleration.
    """

    speed_mm_s: float
    speed_mm_s2: float
    turn_deg_s: float
    turn_deg_s2: float


@dataclass(frozen=True, slots=True)
class Path:
    """A path of straight legs.

    Attributes:
        points: Start, corners, end.
    """

    points: tuple[Point, ...]

    @property
    def length_mm(self) -> float:
        """Length of all legs together."""
        return sum(math.dist(one, other) for one, other in pairwise(self.points))

    def duration_s(self, heading_deg: float, limits: MotionLimits) -> float:
        """Return the shortest time for it, from an initial heading, with stops and turns on the spot at the corners."""
        total_s = 0.0
        for one, other in pairwise(self.points):
            bearing_deg = math.degrees(math.atan2(other[1] - one[1], other[0] - one[0]))
            turn_deg = abs(wrapped_deg(bearing_deg - heading_deg))
            total_s += _travel_s(turn_deg, limits.turn_deg_s, limits.turn_deg_s2)
            total_s += _travel_s(math.dist(one, other), limits.speed_mm_s, limits.speed_mm_s2)
            heading_deg = bearing_deg
        return total_s


@dataclass(frozen=True)
class FloorPlan:
    """A room with its obstacles.

    Attributes:
        size_mm: Extent of the floor, from (0, 0).
        obstacles: All obstacles on it.
        camera: The robot's camera, from whose height pictures must be in view.
    """

    size_mm: tuple[float, float]
    obstacles: tuple[Obstacle, ...]
    camera: Camera = field(default_factory=Camera)

    def clearance_mm(self, points: Floats) -> Floats:
        """Return the clearance of each of `points`, shape (..., 2), to walls and obstacles; negative outside."""
        x, y = points[..., 0], points[..., 1]
        width, depth = self.size_mm
        clearance = np.minimum(np.minimum(x, width - x), np.minimum(y, depth - y))
        for obstacle in self.obstacles:
            clearance = np.minimum(clearance, obstacle.distance_mm(points))
        return np.asarray(clearance, dtype=np.float64)

    def near(self, points: Floats, distance_mm: float) -> FloorPlan:
        """Return the plan without obstacles farther than that from all of `points`, which costs less to work with."""
        flat = points.reshape(-1, 2)
        low, high = flat.min(axis=0).tolist(), flat.max(axis=0).tolist()
        kept = tuple(obstacle for obstacle in self.obstacles if obstacle.near(low, high, distance_mm))
        return replace(self, obstacles=kept)

    def is_free(self, place: Point, radius_mm: float) -> bool:
        """Return whether a robot of that radius may stand at a place."""
        point = np.array([place], np.float64)
        return bool(np.all(self.near(point, radius_mm).clearance_mm(point) >= radius_mm))

    def in_the_way(self, start: Point, end: Point, radius_mm: float) -> list[Obstacle]:
        """Return the obstacles that such a robot would run into on the straight path."""
        line = _line(start, end)
        near = self.near(line, radius_mm).obstacles
        return [obstacle for obstacle in near if np.min(obstacle.distance_mm(line)) < radius_mm]

    def sees(self, camera_mm: Floats, goal: Goal) -> Mask:
        """Return from which of the points `camera_mm`, shape (n, 2), the centre of the picture is not hidden."""
        shares = np.linspace(0.0, 1.0, SIGHT_SAMPLES)
        lines = camera_mm[:, None, :] + shares[None, :, None] * (np.asarray(goal.at_mm) - camera_mm[:, None, :])
        height_mm = self.camera.height_mm
        heights = height_mm + shares * (goal.centre_height_mm - height_mm)
        hidden = np.zeros(len(camera_mm), dtype=np.bool_)
        for obstacle in self.near(lines, 0.0).obstacles:
            if obstacle.name != goal.name:
                hidden |= np.any((obstacle.distance_mm(lines) <= 0.0) & (obstacle.height_mm > heights), axis=1)
        return ~hidden

    def reachable(self, start: Point, goals: Sequence[Goal], radius_mm: float) -> bool:
        """Return whether `path` would find a path to each of the goals, much faster than by calling it."""
        grid = _Grid(self, radius_mm, 0.0)
        first = grid.nearest_free(start)
        if first is None:
            return False
        _, parts = cv2.connectedComponents(grid.free.astype(np.uint8), connectivity=8)
        here = parts == parts[first]
        return all((grid.ends(self, goal) & here).any() for goal in goals)

    def has_stop(self, goal: Goal, radius_mm: float) -> bool:
        """Return whether there is a place where a stop counts, whether or not a path leads there."""
        return bool(_Grid(self, radius_mm, 0.0).ends(self, goal).any())

    def path(
        self,
        start: Point,
        goal: Goal,
        radius_mm: float,
        *,
        inflation_mm: float = 0.0,
    ) -> Path | None:
        """Return a robot's shortest path to a place in view of the picture where a stop counts.

        Args:
            start: Centre of the robot.
            goal: The picture.
            radius_mm: The robot's radius.
            inflation_mm: Additional clearance to keep where that makes the path only a little longer.

        Returns:
            The path, or None if there is none.
        """
        grid = _Grid(self, radius_mm, inflation_mm)
        ends = grid.ends(self, goal)
        first = grid.nearest_free(start)
        if first is None or not ends.any():
            return None
        if ends[first]:
            return Path((start,))
        cells = grid.search(first, ends, goal)
        if not cells:
            return None
        points = [start, *(grid.middle(cell) for cell in cells)]
        return Path(_shortened(self, points, radius_mm + inflation_mm))


class _Grid:
    """The floor as a grid of cells; a cell is free if the robot's centre may be in it."""

    def __init__(self, plan: FloorPlan, radius_mm: float, inflation_mm: float) -> None:
        columns, rows = (max(1, math.ceil(side / CELL_MM)) for side in plan.size_mm)
        x, y = np.meshgrid((np.arange(columns) + 0.5) * CELL_MM, (np.arange(rows) + 0.5) * CELL_MM, indexing="ij")
        self.middles = np.stack([x, y], axis=-1)
        clearance = FloorPlan(plan.size_mm, ()).clearance_mm(self.middles)
        for obstacle in plan.obstacles:
            reach_mm = obstacle.outer_mm + radius_mm + inflation_mm + CELL_MM
            window = tuple(slice(*_span(at_mm, reach_mm)) for at_mm in obstacle.at_mm)
            clearance[window] = np.minimum(clearance[window], obstacle.distance_mm(self.middles[window]))
        self.free: Mask = clearance >= radius_mm
        narrow = np.clip((radius_mm + inflation_mm - clearance) / max(inflation_mm, 1.0), 0.0, 1.0)
        self._cost = 1.0 + NARROW_COST * narrow

    def middle(self, cell: Cell) -> Point:
        return (cell[0] + 0.5) * CELL_MM, (cell[1] + 0.5) * CELL_MM

    def ends(self, plan: FloorPlan, goal: Goal) -> Mask:
        """Return the cells in which a stop counts."""
        ends = self.free & goal.covers(self.middles)
        places = self.middles[ends]
        if len(places):
            ends[ends] = plan.sees(places, goal)
        return ends

    def nearest_free(self, place: Point) -> Cell | None:
        """Return the free cell nearest to a point; None if even that is too far away."""
        distance = self._away_mm(place)
        distance[~self.free] = np.inf
        cell = np.unravel_index(int(np.argmin(distance)), distance.shape)
        return (int(cell[0]), int(cell[1])) if distance[cell] <= FAR_FROM_FREE_CELLS * CELL_MM else None

    def _away_mm(self, place: Point) -> Floats:
        """Return the distance of each cell from a point."""
        return np.asarray(np.hypot(self.middles[..., 0] - place[0], self.middles[..., 1] - place[1]))

    def search(self, first: Cell, ends: Mask, goal: Goal) -> list[Cell]:
        """Return the cells from the first to the nearest end (A*); empty if there is no path."""
        guess = (np.maximum(self._away_mm(goal.at_mm) - goal.reach_mm - CELL_MM, 0.0) / CELL_MM).tolist()
        free, cost, end = self.free.tolist(), self._cost.tolist(), ends.tolist()
        columns, rows = self.free.shape
        best: dict[Cell, float] = {first: 0.0}
        before: dict[Cell, Cell] = {}
        queue = [(guess[first[0]][first[1]], first)]
        done: set[Cell] = set()
        while queue:
            cell = heapq.heappop(queue)[1]
            if cell in done:
                continue
            done.add(cell)
            if end[cell[0]][cell[1]]:
                return _trace(before, cell)
            for dx, dy, length in _STEPS:
                x, y = cell[0] + dx, cell[1] + dy
                if not (0 <= x < columns and 0 <= y < rows and free[x][y]):
                    continue
                total = best[cell] + length * cost[x][y]
                if total < best.get((x, y), math.inf):
                    best[x, y], before[x, y] = total, cell
                    heapq.heappush(queue, (total + guess[x][y], (x, y)))
        return []


def _span(at_mm: float, reach_mm: float) -> tuple[int, int]:
    """Return the first cell within reach of a place along one axis, and the one after the last."""
    return max(0, math.floor((at_mm - reach_mm) / CELL_MM)), max(0, math.ceil((at_mm + reach_mm) / CELL_MM))


def _travel_s(amount: float, speed: float, acceleration: float) -> float:
    """Return the shortest time for a distance or an angle from rest to rest."""
    if amount < speed**2 / acceleration:
        return 2 * math.sqrt(amount / acceleration)
    return amount / speed + speed / acceleration


def _trace(before: dict[Cell, Cell], cell: Cell) -> list[Cell]:
    cells = [cell]
    while cell in before:
        cell = before[cell]
        cells.append(cell)
    return cells[::-1]


def _shortened(plan: FloorPlan, points: Sequence[Point], clearance_mm: float) -> tuple[Point, ...]:
    """Remove needless corners from a path without giving up clearance."""
    taut, i = [points[0]], 0
    while i < len(points) - 1:
        reach = len(points) - 1
        while reach > i + 1 and not _direct(plan, points[i], points[reach], clearance_mm):
            reach -= 1
        i = reach
        if math.dist(points[i], taut[-1]) > SAME_PLACE_MM:
            taut.append(points[i])
    return tuple(taut)


def _direct(plan: FloorPlan, start: Point, end: Point, clearance_mm: float) -> bool:
    """Return whether the straight path keeps the clearance, or as much of it as its ends have."""
    line = _line(start, end)
    clearances = plan.near(line, clearance_mm).clearance_mm(line)  # more clearance than that does not count
    needed = min(clearance_mm, float(clearances[0]), float(clearances[-1])) - SAME_PLACE_MM
    return bool(np.all(clearances >= needed))


def _line(start: Point, end: Point) -> Floats:
    number = max(2, math.ceil(math.dist(start, end) / SAMPLE_MM) + 1)
    return np.linspace(np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64), number)
