"""What sonar and bumper tell about the floor: a grid in the frame of odometry, where evidence fades in time.

A sonar's beam is wide. An echo says that the whole beam is free up to it, and that something is *somewhere* on its arc.
So an echo frees the cone and marks only the arc's middle; from far away it may be to one side and is held a hint, which
a way may cross if it must, until nearer beams confirm or clear it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive.angles import wrapped_deg
from behaviors.ports import Pose

CELL_MM, CELLS = 80.0, 180
"""The grid reaches 7.2 m from the start to each side; what lies farther is not mapped."""

SONAR_FORWARD_MM = 100.0
"""The sonar in front of the axle; about right is enough."""
BEAM_DEG = 15.0
"""Half the beam's angle. Source: docs/worlds.md, ultrasonic sensor."""
ARC_DEG = 11.0
"""So much of an echo's arc is marked to either side."""
NEAR_MM, FAR_MM = 700.0, 1800.0
"""An echo from nearer tells where something is; from farther than the second it tells nothing."""
SILENT_MM = 1200.0
"""Without an echo the floor is taken to be free so far."""
SPARED_MM = 300.0
"""Right before what was seen there may be anything."""
MARGIN_MM = 100.0
"""The floor right before an echo is not called free."""

HINT, SOLID, MOST = 0.3, 1.5, 3.0
"""Evidence from which a cell may be and is occupied, and the most a cell can have; that of free cells is negative."""
FREE_ECHO, FREE_SILENT, FREEST, FREEST_SILENT = 0.35, 0.1, -2.0, -0.5
"""By what an echo from beyond a cell, or silence, lowers its evidence, and below what they do not."""
HIT_NEAR, HIT_FAR = 1.0, 0.5
"""By what an echo from near, or from farther away, raises the evidence of its arc."""
ARC_CELLS = 0.75
"""Half the width of an echo's arc, in cells."""
REPEATED_MM, REPEATED_DEG, REPEATED_RANGE_MM = 25.0, 2.0, 50.0
"""An echo that differs from the last by less than all of these is the last once more."""
KNOWN = 0.1
"""Less evidence is none."""
BEHIND = 0.3
"""What is behind something on the map may still be seen, over it or because the map is wrong."""
UNKNOWN_HIDES_MM = 2500.0
"""On so much unknown floor there is nothing that hides in one case out of e."""
FADES_S = 90.0
"""Evidence falls to a third in this time: things move, and so does odometry."""
BLOCK_RADIUS_MM, BLOCK = 250.0, 2.2
"""What blocks the way is taken to be so large until it is seen better, on so much evidence: a few echoes clear it."""
FOOTPRINT_MM = 130.0
"""The robot's own radius."""
DIRECTIONS = 72
"""In which lines of sight are followed, 5 degrees apart."""

Grid = NDArray[np.float32]
Mask = NDArray[np.bool_]


class OccupancyGrid:
    """A grid of evidence for obstacles, (CELLS, CELLS), indexed [x, y]; the start lies in the middle."""

    def __init__(self) -> None:
        self.evidence: Grid = np.zeros((CELLS, CELLS), np.float32)
        self._time_s = -math.inf
        self._last: tuple[Pose, float] | None = None

    def fade(self, now_s: float) -> None:
        """Let old evidence fade."""
        if now_s - self._time_s > 1.0:
            if self._time_s > -math.inf:
                self.evidence *= np.float32(math.exp((self._time_s - now_s) / FADES_S))
            self._time_s = now_s

    def echo(self, pose: Pose, range_mm: float) -> None:
        """Take in an echo; one that repeats the last from the same place tells of nothing new in the way."""
        repeated = self._last is not None and _same(self._last, (pose, range_mm))
        self._last = (pose, range_mm)
        x_mm, y_mm = pose.ahead(SONAR_FORWARD_MM)
        reach_mm = min(range_mm, FAR_MM)
        window, along, off_deg = _polar(x_mm, y_mm, pose.heading_deg, reach_mm + 2 * CELL_MM)
        cells = self.evidence[window]
        free = (along < reach_mm - MARGIN_MM) & (off_deg <= BEAM_DEG)
        cells[free] = np.maximum(cells[free] - FREE_ECHO, FREEST)
        if range_mm >= FAR_MM or repeated:
            return
        hit = (np.abs(along - range_mm) <= CELL_MM * ARC_CELLS) & (off_deg <= ARC_DEG)
        gain, most = (HIT_NEAR, MOST) if range_mm <= NEAR_MM else (HIT_FAR, SOLID - 0.1)
        cells[hit] = np.maximum(cells[hit], np.minimum(cells[hit] + gain, most))

    def no_echo(self, pose: Pose) -> None:
        """Take in that nothing answered: most likely nothing is near, but smooth things throw echoes away."""
        if self._last is not None and _same(self._last, (pose, math.inf)):
            return
        self._last = (pose, math.inf)
        x_mm, y_mm = pose.ahead(SONAR_FORWARD_MM)
        window, along, off_deg = _polar(x_mm, y_mm, pose.heading_deg, SILENT_MM)
        cells = self.evidence[window]
        free = (along < SILENT_MM) & (off_deg <= BEAM_DEG)
        cells[free] = np.maximum(cells[free] - FREE_SILENT, np.minimum(cells[free], FREEST_SILENT))

    def seen_past(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Take in that `end` was seen from `start`: what is only suspected in between is not there."""
        length = math.dist(start, end)
        share = np.arange(0.0, max(0.0, length - SPARED_MM), CELL_MM / 2) / max(length, 1.0)
        i = _index(start[0] + share * (end[0] - start[0]))
        j = _index(start[1] + share * (end[1] - start[1]))
        cells = self.evidence[i, j]
        self.evidence[i, j] = np.where((cells > 0.0) & (cells < SOLID), 0.0, cells)

    def forget_obstacles(self) -> None:
        """Begin again with everything that was thought to be in the way."""
        np.minimum(self.evidence, 0.0, out=self.evidence)

    def stands_on(self, pose: Pose) -> None:
        """Where the robot is, nothing else is."""
        window, along, _ = _polar(pose.x_mm, pose.y_mm, 0.0, FOOTPRINT_MM)
        cells = self.evidence[window]
        cells[along <= FOOTPRINT_MM] = FREEST

    def block(self, pose: Pose, range_mm: float) -> None:
        """Remember something in the way, of a size not known yet: what stopped the robot or touched it."""
        x_mm, y_mm = pose.ahead(SONAR_FORWARD_MM + range_mm + BLOCK_RADIUS_MM * 0.6)
        window, along, _ = _polar(x_mm, y_mm, 0.0, BLOCK_RADIUS_MM)
        cells = self.evidence[window]
        inside = along <= BLOCK_RADIUS_MM
        cells[inside] = np.maximum(cells[inside], BLOCK)

    def sight(self, x_mm: float, y_mm: float, limit_mm: float) -> NDArray[np.float64]:
        """How likely nothing hides what is so far away, (DIRECTIONS, steps of CELL_MM), up to `limit_mm` from a place.

        What is known to be free hides nothing; of what is unknown, the more there is, the likelier something hides.
        """
        steps = np.arange(CELL_MM, limit_mm + CELL_MM, CELL_MM)
        i = _index(x_mm + steps[None, :] * _ALONG[:, 0:1])
        j = _index(y_mm + steps[None, :] * _ALONG[:, 1:2])
        evidence = self.evidence[i, j]
        evidence[:, :2] = -1.0  # the robot itself stands there
        behind = np.logical_or.accumulate(evidence > HINT, axis=1)
        unknown_mm = np.cumsum(np.abs(evidence) < KNOWN, axis=1) * CELL_MM
        return np.asarray(np.where(behind, BEHIND, np.exp(-unknown_mm / UNKNOWN_HIDES_MM)), np.float64)

    def clear_between(
        self, start: tuple[float, float], end: tuple[float, float], short_mm: float = 0.0, elbow_mm: float = 0.0
    ) -> bool:
        """Whether the robot could drive straight from `start` to `short_mm` before `end`, as far as is known.

        With `elbow_mm` there is so much room beside it.
        """
        return self.blocked_after_mm(start, end, short_mm, elbow_mm) is None

    def blocked_after_mm(
        self, start: tuple[float, float], end: tuple[float, float], short_mm: float = 0.0, elbow_mm: float = 0.0
    ) -> float | None:
        """How far it is from `start` to what blocks the way that `clear_between` tells of; None if nothing does."""
        length = math.dist(start, end) - short_mm
        if length <= 0:
            return None
        ux, uy = (end[0] - start[0]) / (length + short_mm), (end[1] - start[1]) / (length + short_mm)
        along = np.arange(FOOTPRINT_MM, max(length, FOOTPRINT_MM + 1), CELL_MM * 0.75)
        half_mm = FOOTPRINT_MM - CELL_MM / 4 + elbow_mm
        across = np.linspace(-half_mm, half_mm, 7)
        i = _index(start[0] + along[:, None] * ux - across[None, :] * uy)
        j = _index(start[1] + along[:, None] * uy + across[None, :] * ux)
        blocked = (self.evidence[i, j] > SOLID).any(axis=1)
        return float(along[blocked.argmax()]) if blocked.any() else None


_ANGLES = np.radians(np.arange(DIRECTIONS) * 360.0 / DIRECTIONS)
_ALONG = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def centre_mm(index: NDArray[np.int64]) -> NDArray[np.float64]:
    """Middle of the cells with these indices along one axis."""
    return np.asarray((index - CELLS // 2 + 0.5) * CELL_MM)


def cell(x_mm: float, y_mm: float) -> tuple[int, int]:
    """Indices of the cell at a place; of the nearest one outside of the grid."""
    return int(_index(np.float64(x_mm))), int(_index(np.float64(y_mm)))


def _index(value_mm: NDArray[np.float64] | np.float64) -> NDArray[np.int64]:
    return np.clip(np.floor(value_mm / CELL_MM).astype(np.int64) + CELLS // 2, 0, CELLS - 1)


def _polar(
    x_mm: float, y_mm: float, heading_deg: float, radius_mm: float
) -> tuple[tuple[slice, slice], NDArray[np.float64], NDArray[np.float64]]:
    """The cells around a place: their window, distances, and angles off a heading."""
    (i0, j0), (i1, j1) = cell(x_mm - radius_mm, y_mm - radius_mm), cell(x_mm + radius_mm, y_mm + radius_mm)
    dx = (centre_mm(np.arange(i0, i1 + 1)) - x_mm)[:, None]
    dy = (centre_mm(np.arange(j0, j1 + 1)) - y_mm)[None, :]
    off_deg = np.abs(wrapped_deg(np.degrees(np.arctan2(dy, dx)) - heading_deg))
    return (slice(i0, i1 + 1), slice(j0, j1 + 1)), np.hypot(dx, dy), off_deg


def _same(one: tuple[Pose, float], other: tuple[Pose, float]) -> bool:
    """Whether two echoes, infinity standing for none, are one measurement as far as the map is concerned."""
    (a, range_a), (b, range_b) = one, other
    moved = math.hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm)
    alike = range_a == range_b or abs(range_a - range_b) < REPEATED_RANGE_MM
    return moved < REPEATED_MM and abs(a.heading_deg - b.heading_deg) < REPEATED_DEG and alike
