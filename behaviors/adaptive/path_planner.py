"""Path planning on the occupancy grid: how long it takes from here to anywhere, and along which waypoints."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive.grid_cells import CELL_MM, Mask
from behaviors.adaptive.grid_tuning import FREE, HINT, SOLID
from behaviors.adaptive.occupancy_grid import Grid, OccupancyGrid
from behaviors.ports import Point

CLEARANCE_MM = 40.0
"""Room beside the robot that a path must leave."""
SEEN_CLEARANCE_MM = 20.0
"""The same beside obstacles that the camera saw, which the map places accurately."""
INFLATION_COSTS = ((320.0, 2.0), (250.0, 3.0), (210.0, 4.0))
"""Within each radius, mm, of an obstacle a cell costs this many cells of free floor: wheels slip and echoes err, and a
path should lead through the middle of a door."""
BEYOND_CELLS = 8
"""Paths go this many cells beyond the known floor at most."""
DOUBTFUL_COST = 5.0
"""Cost of a cell that may be occupied."""
LIKELY_COST = 25.0
"""Cost of a cell with higher log odds than `LIKELY_LOG_ODDS`."""
LIKELY_LOG_ODDS = 0.8
"""Higher ones than this come from several echoes."""
UNKNOWN_COST = 1.4
"""Cost of a cell that is not known."""
UNKNOWN_COST_WITHOUT_SONAR = 8.0
"""The same without a sonar, which would detect an obstacle there in time."""
FEW_PLACES = 6
"""A robot that can reach fewer places than this is walled in."""
FEW_SPACING_MM = 400.0
"""Spacing of the places that are counted for it."""
TOUCHED_LOG_ODDS = 0.05
"""A cell with log odds nearer to 0 than this counts as never looked at and does not extend the map."""
NARROW_COST = 15.0
"""Cost of a cell that is known as free but too near to an obstacle: the sonar's beam is wide, and a gap looks narrower
on the map than it is."""
FRONTIER_CELLS = 5
"""Unknown floor this near to free floor counts as known where nothing suspected lies between."""
STRAIGHT, STRAIGHT_CELLS = 1.02, 0.5
"""A straight line replaces a path if it costs no more than this many times as much, plus this many cells of free floor;
a path on the grid has corners of 45 degrees and is up to 8 % longer."""
TOGETHER_COST = 8.0
"""Paths whose costs differ by no more than this grow at the same time, which changes the speed only."""
_NEIGHBOURS = [(i, j, math.hypot(i, j)) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]


class PathPlanner:
    """All paths from one place.

    Args:
        floor: What is known of the floor.
        start: Where the robot is.
        speed_mm_s: How fast it drives.
    """

    def __init__(self, floor: OccupancyGrid, start: Point, speed_mm_s: float) -> None:
        self._begin = start
        self._cells = floor.cells
        self._window, self._cost = _costs(floor, start)
        self._start = self._cell(start)
        self._pace = CELL_MM / speed_mm_s
        self._log_odds, self._without_sonar = floor.log_odds[self._window].copy(), floor.without_sonar
        self._solid = self._log_odds > SOLID
        self._field = _spread(self._cost, self._solid, self._start)

    def seconds_to(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the driving time to each of the points (n, 2); infinity where no path leads."""
        i, j = (
            self._cells.unclipped_index(each) - part.start for each, part in zip(points.T, self._window, strict=True)
        )
        inside = (i >= 0) & (j >= 0) & (i < self._field.shape[0]) & (j < self._field.shape[1])
        seconds = np.full(len(points), np.inf)
        seconds[inside] = self._field[i[inside], j[inside]] * self._pace
        return seconds

    def seconds_along(self, route: tuple[Point, ...]) -> float:
        """Return the driving time along waypoints from the start, infinity if something blocks them."""
        cells = sum(share * length_mm for share, length_mm in self._means(self._cost, math.inf, route))
        return cells / CELL_MM * self._pace

    def unknown_mm(self, route: tuple[Point, ...]) -> float:
        """Return how much of the path along waypoints from the start crosses unknown floor."""
        unknown = np.abs(self._log_odds) <= TOUCHED_LOG_ODDS
        return sum(share * length_mm for share, length_mm in self._means(unknown, 1.0, route))

    def _means(
        self, values: NDArray[np.generic], beyond: float, route: tuple[Point, ...]
    ) -> Iterator[tuple[float, float]]:
        """Yield, for each leg of a route from the start, the mean of the cells' values along it, and its length.

        A leg that leaves the known part of the floor has the value `beyond`.
        """
        rows, columns = values.shape
        for one, other in pairwise((self._begin, *route)):
            length_mm = math.dist(one, other)
            share = np.linspace(0.0, 1.0, 2 + int(2 * length_mm / CELL_MM))
            i, j = (
                self._cells.unclipped_index(a + share * (b - a)) - part.start
                for a, b, part in zip(one, other, self._window, strict=True)
            )
            inside = i.min() >= 0 and j.min() >= 0 and i.max() < rows and j.max() < columns
            yield float(np.mean(values[i, j])) if inside else beyond, length_mm

    @property
    def walled_in(self) -> bool:
        """Whether there are hardly any places to go to."""
        return len(self.reachable_places(FEW_SPACING_MM, known=False)) < FEW_PLACES

    def reaches(self, point: Point) -> bool:
        """Return whether a path leads there."""
        return bool(np.isfinite(self.seconds_to(np.array([point])))[0])

    def reachable_places(self, spacing_mm: float, *, known: bool) -> NDArray[np.float64]:
        """Return reachable places, (n, 2), about this far apart; with `known` only on or near free floor."""
        every = max(1, round(spacing_mm / CELL_MM))
        within = np.isfinite(self._field)
        if known and not self._without_sonar:  # without a sonar only floor that was driven over becomes known
            within &= _with_frontier(self._log_odds)
        i, j = np.nonzero(within[::every, ::every])
        return self._centres_mm(i * every, j * every)

    def route_to(self, point: Point) -> tuple[Point, ...]:
        """Return the waypoints to `point`, which must be reachable; the start is left out."""
        at = self._cell(point)
        steps = [at]
        while at != self._start:
            at = min(self._steps_from(at), key=lambda each: self._field[each])
            if at in steps[-3:]:
                break
            steps.append(at)
        steps.reverse()
        return self._straightened(steps, point)

    def _cell(self, point: Point) -> tuple[int, int]:
        """Return the cell of a point, in the known part of the floor."""
        i, j = self._cells.at(*point)
        return i - self._window[0].start, j - self._window[1].start

    def _centres_mm(self, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the centres of cells of the known part of the floor, (n, 2)."""
        rows, columns = self._window
        return np.stack([self._cells.centre_mm(i + rows.start), self._cells.centre_mm(j + columns.start)], axis=1)

    def _steps_from(self, at: tuple[int, int]) -> list[tuple[int, int]]:
        """Return the cells beside this one, without those beyond the corner of a solid one."""
        rows, columns = self._field.shape
        beside = [(at[0] + i, at[1] + j) for i, j, _ in _NEIGHBOURS]
        within = [(i, j) for i, j in beside if 0 <= i < rows and 0 <= j < columns]
        return [(i, j) for i, j in within if not (self._solid[at[0], j] or self._solid[i, at[1]])]

    def _straightened(self, steps: list[tuple[int, int]], end: Point) -> tuple[Point, ...]:
        """Return few of the steps, joined by straight lines that cost hardly more than the path, and the end."""
        ij = np.array(steps[1:-1], np.int64).reshape(-1, 2)
        places = [self._begin, *((x_mm, y_mm) for x_mm, y_mm in self._centres_mm(*ij.T).tolist()), end]
        corners, here = [], 0
        while here < len(steps) - 1:
            there = len(steps) - 1
            while there > here + 1 and not (
                self._cheap(steps[here], steps[there]) and self._open(places[here], places[there])
            ):
                there -= max(1, (there - here) // 4)
            here = there
            corners.append(places[here])
        return (*corners[:-1], end)

    def _cheap(self, one: tuple[int, int], other: tuple[int, int]) -> bool:
        """Return whether the straight line between two steps costs hardly more than the path."""
        count = max(abs(other[0] - one[0]), abs(other[1] - one[1])) * 2 + 1
        i = np.rint(np.linspace(one[0], other[0], count)).astype(np.int64)
        j = np.rint(np.linspace(one[1], other[1], count)).astype(np.int64)
        cost = float(np.mean(self._cost[i, j])) * math.dist(one, other)
        return cost <= STRAIGHT * float(self._field[other] - self._field[one]) + STRAIGHT_CELLS

    def _open(self, one: Point, other: Point) -> bool:
        """Return whether the straight line between two places crosses no solid cell."""
        i, j = self._cells.crossed(one, other)
        return not self._solid[i - self._window[0].start, j - self._window[1].start].any()


def _costs(floor: OccupancyGrid, start: Point) -> tuple[tuple[slice, slice], NDArray[np.float64]]:
    """Return the known part of the floor, and the cost of crossing each of its cells, in cells of free floor."""
    log_odds = floor.log_odds
    known = np.abs(log_odds) > TOUCHED_LOG_ODDS
    i, j = floor.cells.at(*start)
    known[i, j] = True
    window = (_span(np.any(known, axis=1)), _span(np.any(known, axis=0)))
    part = log_odds[window]
    solid = part > SOLID
    blocked = _inflated(solid, floor.radius_mm + CLEARANCE_MM)
    cost = np.ones(part.shape)
    cost[np.abs(part) <= TOUCHED_LOG_ODDS] = UNKNOWN_COST_WITHOUT_SONAR if floor.without_sonar else UNKNOWN_COST
    for radius_mm, price in INFLATION_COSTS:
        cost[_inflated(solid, radius_mm)] = price
    cost[_inflated((part > HINT) & ~solid, floor.radius_mm)] = DOUBTFUL_COST
    cost[_inflated((part > LIKELY_LOG_ODDS) & ~solid, floor.radius_mm)] = LIKELY_COST
    cost[blocked] = np.inf
    seen = _inflated(solid & floor.seen[window], floor.radius_mm + SEEN_CLEARANCE_MM)
    cost[blocked & (part < -FREE) & ~seen] = NARROW_COST
    si, sj = i - window[0].start, j - window[1].start
    # the robot can always leave the place where it stands
    around = cost[max(0, si - 2) : si + 3, max(0, sj - 2) : sj + 3]
    near = solid[max(0, si - 2) : si + 3, max(0, sj - 2) : sj + 3]
    around[np.isinf(around) & ~near] = DOUBTFUL_COST
    cost[si, sj] = 1.0
    return window, cost


def _with_frontier(log_odds: Grid) -> Mask:
    """Return the floor known to be free, and what lies just beyond it with nothing suspected in between."""
    known: Mask = log_odds < -FREE
    open_floor = known | ~_inflated(log_odds > HINT, math.hypot(CELL_MM, CELL_MM))
    for _ in range(FRONTIER_CELLS):
        known = _inflated(known, CELL_MM) & open_floor
    return known


def _span(used: NDArray[np.bool_]) -> slice:
    places = np.nonzero(used)[0]
    return slice(max(0, int(places[0]) - BEYOND_CELLS), min(len(used), int(places[-1]) + BEYOND_CELLS + 1))


def _inflated(mask: Mask, radius_mm: float) -> Mask:
    """Inflate a mask by a radius."""
    cells = int(radius_mm / CELL_MM) if mask.any() else 0
    inflated = mask.copy()
    for i in range(-cells, cells + 1):
        for j in range(-cells, cells + 1):
            if 0 < math.hypot(i, j) * CELL_MM <= radius_mm:
                target, source = _shifted(i, mask.shape[0]), _shifted(-i, mask.shape[0])
                target_j, source_j = _shifted(j, mask.shape[1]), _shifted(-j, mask.shape[1])
                inflated[target, target_j] |= mask[source, source_j]
    return inflated


def _shifted(step: int, size: int) -> slice:
    return slice(max(0, step), size + min(0, step))


def _spread(cost: NDArray[np.float64], solid: Mask, start: tuple[int, int]) -> NDArray[np.float64]:
    """Return the cost of the shortest path to every cell; no step leads round the corner of a solid one.

    As in Dijkstra's algorithm the nearest cells go first, but many at once; one that a shorter path reaches later goes
    again.
    """
    width = cost.shape[1] + 2
    prices = np.pad(cost, 1, constant_values=np.inf).ravel()  # no path leads over the rim
    offsets = np.array([[i * width + j] for i, j, _ in _NEIGHBOURS])
    lengths = _step_lengths(solid)
    field, waits = np.full(prices.shape, np.inf), np.zeros(prices.shape, np.bool_)
    cells = np.array([(start[0] + 1) * width + start[1] + 1])
    field[cells] = 0.0
    while len(cells):
        reached = field[cells]
        near = reached <= reached.min() + TOGETHER_COST
        waits[cells] = ~near
        beside = cells[near] + offsets
        through = reached[near] + prices[beside] * lengths[:, cells[near]]
        shorter = through < field[beside]
        beside, through = beside[shorter], through[shorter]
        np.minimum.at(field, beside, through)
        waits[beside] = True
        cells = np.flatnonzero(waits)
    return field.reshape(-1, width)[1:-1, 1:-1].copy()


def _step_lengths(solid: Mask) -> NDArray[np.float64]:
    """Return the length in cells of each step to a neighbour, (8, cells with a rim of one); infinity round a corner."""
    rimmed = np.pad(solid, 1).ravel()
    width = solid.shape[1] + 2
    lengths = np.empty((len(_NEIGHBOURS), len(rimmed)))
    for k, (i, j, length) in enumerate(_NEIGHBOURS):
        lengths[k] = np.where(np.roll(rimmed, -i * width) | np.roll(rimmed, -j), np.inf, length) if i and j else length
    return lengths
