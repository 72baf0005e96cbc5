"""The cells of the occupancy grid: where they are, and which of them a beam, a disc or a ray meets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from behaviors.angles import wrapped_deg
from behaviors.ports import Point

CELL_MM = 80.0
"""Size of a cell."""

Mask = NDArray[np.bool_]
Window = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Cells:
    """The cells of a square grid with the start in its middle.

    Attributes:
        side: How many there are along each axis, an even number; 180 reach 7.2 m from the start to each side.
    """

    side: int = 180

    @property
    def reach_mm(self) -> float:
        """How far the grid reaches from the start along each axis."""
        return self.side * CELL_MM / 2

    def centre_mm(self, indices: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the centres of the cells with these indices along one axis."""
        return np.asarray((indices - self.side // 2 + 0.5) * CELL_MM)

    def at(self, x_mm: float, y_mm: float) -> tuple[int, int]:
        """Return the indices of the cell at a place; outside of the grid, of the nearest cell."""
        middle, last = self.side // 2, self.side - 1
        i, j = (min(max(math.floor(value_mm / CELL_MM) + middle, 0), last) for value_mm in (x_mm, y_mm))
        return i, j

    def unclipped_index(self, value_mm: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the indices of the cells at places along one axis, as if the grid had no end."""
        return np.floor(value_mm / CELL_MM).astype(np.int64) + self.side // 2

    def index(self, value_mm: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the indices of the cells at places along one axis; outside of the grid, of the nearest cell."""
        # `np.clip` takes longer
        return np.minimum(np.maximum(self.unclipped_index(value_mm), 0), self.side - 1)

    def crossed(self, one: Point, other: Point) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the indices of all cells that a straight line crosses."""
        borders = [
            (np.arange(math.ceil(min(a, b) / CELL_MM), max(a, b) / CELL_MM) * CELL_MM - a) / (b - a)
            for a, b in zip(one, other, strict=True)
            if a != b
        ]
        shares = np.sort(np.concatenate([(0.0, 1.0), *borders]))
        inside = (shares[1:] + shares[:-1]) / 2
        i, j = (self.index(a + inside * (b - a)) for a, b in zip(one, other, strict=True))
        return i, j

    def around(
        self, x_mm: float, y_mm: float, radius_mm: float
    ) -> tuple[Window, NDArray[np.float64], NDArray[np.float64]]:
        """Return the cells around a place: their window, and how far they are from it along each axis."""
        (i0, j0), (i1, j1) = self.at(x_mm - radius_mm, y_mm - radius_mm), self.at(x_mm + radius_mm, y_mm + radius_mm)
        dx = (self.centre_mm(np.arange(i0, i1 + 1)) - x_mm)[:, None]
        dy = (self.centre_mm(np.arange(j0, j1 + 1)) - y_mm)[None, :]
        return (slice(i0, i1 + 1), slice(j0, j1 + 1)), dx, dy

    def disc(self, x_mm: float, y_mm: float, radius_mm: float) -> tuple[Window, Mask]:
        """Return the cells around a place: their window, and which of them are within the radius."""
        window, dx, dy = self.around(x_mm, y_mm, radius_mm)
        return window, np.hypot(dx, dy) <= radius_mm

    def cone(self, x_mm: float, y_mm: float, heading_deg: float, reach_mm: float, half_deg: float) -> Cone:
        """Return the cells that a beam from a place may meet."""
        window, dx, dy = self.around(x_mm, y_mm, reach_mm)
        off_deg = wrapped_deg(np.degrees(np.arctan2(dy, dx)) - heading_deg)
        return Cone(window, np.hypot(dx, dy), off_deg, np.abs(off_deg) <= half_deg, heading_deg)


@dataclass(frozen=True, slots=True)
class Cone:
    """The cells that a beam may meet.

    Attributes:
        window: The cells around the sonar.
        along_mm: How far away each is.
        off_deg: How far to the right of the beam's axis.
        inside: Which are in the beam.
        heading_deg: The direction of its axis.
    """

    window: Window
    along_mm: NDArray[np.float64]
    off_deg: NDArray[np.float64]
    inside: Mask
    heading_deg: float

    def arc(self, range_mm: float, half_mm: float) -> Mask:
        """Return which cells are at a distance, to within `half_mm`."""
        return np.asarray(self.inside & (np.abs(self.along_mm - range_mm) <= half_mm))
