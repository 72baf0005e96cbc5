"""The belief about a target: a probability for every place and facing, lowered by every frame that did not show it.

A frame without the target is evidence against the places that it would have shown, as strong as the detector is
reliable at that distance and angle. Places that are far away, seen obliquely or behind an obstacle lose little; so a
target that was merely missed keeps its probability where it is, and one that is elsewhere gains it there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive import belief_tuning as tuning
from behaviors.adaptive.grid_cells import CELL_MM
from behaviors.adaptive.grid_tuning import FREE, HINT, KNOWN
from behaviors.adaptive.occupancy_grid import DIRECTIONS, Grid, OccupancyGrid
from behaviors.angles import wrapped_deg
from behaviors.ports import Point, Pose

_FACING_DEG = np.arange(tuning.FACINGS) * 360.0 / tuning.FACINGS

Array = NDArray[np.float64]


@lru_cache(maxsize=1)  # the map has one size at a time
def _places(reach_mm: float) -> tuple[Array, Array]:
    """Return the places up to this far from the start along each axis: forward of it, and to the right, (places,)."""
    axis_mm = np.arange(-reach_mm, reach_mm + 1, tuning.SPACING_MM)
    x_mm, y_mm = np.meshgrid(axis_mm, axis_mm, indexing="ij")
    return x_mm.ravel(), y_mm.ravel()


def likely_places(floor: OccupancyGrid) -> Array:
    """Return how likely a target is at each place when nothing is known of it, (places,), at most 1.

    Targets stand on floor, so a place is less likely the farther it is from all floor that is known to be free.
    """
    x_mm, y_mm = _places(floor.cells.reach_mm - tuning.EDGE_MM)
    i, j = floor.cells.index(x_mm), floor.cells.index(y_mm)
    free = floor.log_odds < -FREE
    steps = range(-tuning.FREE_CELLS, tuning.FREE_CELLS + 1, tuning.FREE_CELLS)
    known = np.hypot(x_mm, y_mm) < tuning.SPACING_MM / 2  # it stands there
    for a, b in product(steps, steps):
        known |= free[i + a, j + b]
    # first along each row, then over all rows: all pairs of places would be too many
    axis_mm = y_mm[: math.isqrt(len(y_mm))]
    squares = (axis_mm[:, None] - axis_mm) ** 2
    in_row = (np.where(known, 0.0, np.inf).reshape(squares.shape)[:, None, :] + squares).min(axis=2)
    nearest = (squares[:, :, None] + in_row).min(axis=1).ravel()
    return np.asarray(np.exp(-nearest / tuning.LIKELY_MM**2 / 2))


def _framed(values: Array, places: int, value: float) -> Array:
    """Return values of places, (places, ...), with this many more places on each side, which have another value."""
    side, each = math.isqrt(len(values)), values.shape[1:]
    widths = [(places, places), (places, places), *[(0, 0)] * len(each)]
    return np.pad(values.reshape(side, side, *each), widths, constant_values=value).reshape(-1, *each)


@dataclass(frozen=True, slots=True)
class _View:
    """What can be seen from a place, turning round.

    Attributes:
        at: The place.
        near: Indices of the places that are near enough, (n,).
        possible: Probability that a target can be found from here at all, (n, facings): not hidden, not oblique.
        each: Probability that one frame finds it, if it can be found, (n,).
        bearing_deg: Direction in which it would be, (n,).
    """

    at: Point
    near: NDArray[np.int64]
    possible: Array
    each: Array
    bearing_deg: Array


@lru_cache(maxsize=1)  # targets that a frame does not show are looked for from one place
def _seen_from(
    x_mm: float, y_mm: float, reach_mm: float, far_mm: float
) -> tuple[NDArray[np.int64], Array, Array, Array]:
    """Return the places near one: their indices, distance and bearing, and the share of slants that is recognised."""
    xs_mm, ys_mm = _places(reach_mm)
    near = np.flatnonzero((np.abs(xs_mm - x_mm) <= far_mm) & (np.abs(ys_mm - y_mm) <= far_mm))
    dx, dy = xs_mm[near] - x_mm, ys_mm[near] - y_mm
    bearing_deg = np.degrees(np.arctan2(dy, dx))
    slant_deg = np.abs(wrapped_deg(_FACING_DEG[None, :] - (bearing_deg + 180.0)[:, None]))
    return near, np.hypot(dx, dy), bearing_deg, _found_at(slant_deg)


def _found_at(slant_deg: Array) -> Array:
    """Return the share of looks that find a picture seen at this slant."""
    return np.asarray(1.0 / (1.0 + np.exp((slant_deg - tuning.HALF_SLANT_DEG) / tuning.SLANT_WIDTH_DEG)))


def _along(sight: Array, distance_mm: Array, bearing_deg: Array) -> Array:
    """Return the chance of a free line of sight up to each distance in each direction."""
    direction = np.rint(bearing_deg * DIRECTIONS / 360.0).astype(np.int64) % DIRECTIONS
    step = np.clip(distance_mm / CELL_MM, 0, sight.shape[1] - 1).astype(np.int64)
    return np.asarray(sight[direction, step])


@dataclass(slots=True)
class _Viewpoint:
    """What was looked at from one place. What hides a target hides it in every frame, so frames are not independent.

    Attributes:
        at: The place.
        missed: Probability of having missed it in all frames so far although it can be found, (places,); 1 where it
            is too far away.
        left: Factor by which the belief was lowered from here, (places, facings); 1 where nothing was missed.
    """

    at: Point
    missed: Array
    left: Array


class Belief:
    """The belief about one target, over (places, facings).

    Args:
        range_mm: How far away its detector finds it in good light.
        half_view_deg: Half the angle of view that can be relied on.
        likely: How likely it is at each place of the map while nothing is known of it, by `likely_places`.

    Attributes:
        reach_mm: From the start to the farthest place along each axis.
    """

    def __init__(self, range_mm: float, half_view_deg: float, likely: Array) -> None:
        self._range_mm = range_mm
        # beyond the second stretch no frame finds it, also from the other side of the stand
        self._far_mm = max(tuning.FRONTIER_MM, tuning.BLIND_SHARE * range_mm + 2 * tuning.VIEWPOINT_MM)
        self._half_view_deg = half_view_deg
        self._learned = np.ones((len(likely), tuning.FACINGS))  # what was learned, as a factor on how likely it was
        self._unlearned = 1.0  # this factor where nothing was learned
        self._viewpoint: _Viewpoint | None = None
        self._plausible_on: tuple[Grid, Array] | None = None
        self._use(likely)

    def follow(self, likely: Array) -> None:
        """Update with a map that shows more floor, and may have grown: there are more places, and others are likely.

        Args:
            likely: What `likely_places` returns for it.
        """
        places = (math.isqrt(len(likely)) - math.isqrt(len(self._likely))) // 2
        if places:
            self._learned = _framed(self._learned, places, self._unlearned)
            if self._viewpoint is not None:
                self._viewpoint.missed = _framed(self._viewpoint.missed, places, 1.0)
                self._viewpoint.left = _framed(self._viewpoint.left, places, 1.0)
        self._use(likely)

    def _use(self, likely: Array) -> None:
        self._likely = likely
        self.reach_mm = (math.isqrt(len(likely)) - 1) / 2 * tuning.SPACING_MM
        self._x, self._y = _places(self.reach_mm)
        self._normalise()

    def _normalise(self) -> None:
        left = float(self._mass().sum())
        self._learned /= left
        self._unlearned /= left

    def _mass(self, places: NDArray[np.bool_] | slice = slice(None)) -> Array:
        """Return the probability of these places, or all, and each facing, (places, facings)."""
        return self._learned[places] * self._likely[places, None]

    def by_place(self) -> Array:
        """Return the probability that the target is at each place, whichever way it faces, indexed [x, y]."""
        side = math.isqrt(len(self._x))
        return np.asarray(self._mass().sum(axis=1).reshape(side, side))

    def look(self, pose: Pose, floor: OccupancyGrid, frames: int) -> None:
        """Update with frames from a pose that did not show it."""
        view = self._view(pose.x_mm, pose.y_mm, floor)
        if self._viewpoint is None or math.dist(self._viewpoint.at, view.at) > tuning.VIEWPOINT_MM:
            self._viewpoint = _Viewpoint(view.at, np.ones(len(self._x)), np.ones_like(self._learned))
        viewpoint = self._viewpoint
        off_deg = np.abs(wrapped_deg(view.bearing_deg - pose.heading_deg))
        inside = off_deg <= self._half_view_deg
        viewpoint.missed[view.near[inside]] *= (1.0 - view.each[inside]) ** frames
        left = 1.0 - view.possible * np.minimum(tuning.MAX_FOUND_CHANCE, 1.0 - viewpoint.missed[view.near])[:, None]
        self._learned[view.near] *= left / viewpoint.left[view.near]
        viewpoint.left[view.near] = left
        self._normalise()

    def see(self, place: Point, seen_from: Point, slant_deg: float | None = None) -> None:
        """Update with a sighting at a place, from another, at the slant that its width implies."""
        near = self._near(place)
        if near.any():  # odometry may have drifted beyond the places that are considered
            back_deg = math.degrees(math.atan2(seen_from[1] - place[1], seen_from[0] - place[0]))
            off_deg = np.abs(wrapped_deg(_FACING_DEG - back_deg))
            likely = np.where(off_deg <= tuning.STEEPEST_DEG, 1.0, 0.0)
            if slant_deg is not None:
                likely = likely * np.exp(-(((off_deg - slant_deg) / tuning.SLANT_SD_DEG) ** 2) / 2)
            likely = likely * (self._facings_at(near) + tuning.TURNED_WEIGHT)
            self._unlearned *= 1.0 - tuning.SIGHTING_SHARE
            self._learned *= 1.0 - tuning.SIGHTING_SHARE
            held = tuning.SIGHTING_SHARE * (likely / likely.sum())[None, :] / int(near.sum())
            self._learned[near] += held / self._likely[near][:, None]
        self._viewpoint = None  # a target in view is not hidden: missing it from now on is new evidence

    def _near(self, place: Point) -> NDArray[np.bool_]:
        """Return which places of the grid are at a place."""
        return np.asarray(np.hypot(self._x - place[0], self._y - place[1]) <= tuning.SPIKE_MM)

    def _facings_at(self, near: NDArray[np.bool_]) -> Array:
        """Return which way it faces if it is at one of these places, as a probability for each facing."""
        held = self._mass(near).sum(axis=0) + 1e-9
        return np.asarray(held / held.sum())

    def faces(self, place: Point, viewpoints: Array) -> Array:
        """Return the probability that a target at `place` faces each of the viewpoints (n, 2) enough to be found."""
        near = self._near(place)
        back_deg = np.degrees(np.arctan2(viewpoints[:, 1] - place[1], viewpoints[:, 0] - place[0]))
        off_deg = np.abs(wrapped_deg(_FACING_DEG[None, :] - back_deg[:, None]))
        return np.asarray(_found_at(off_deg) @ self._facings_at(near))

    def refute(self, place: Point) -> None:
        """Update with a place where it is not, although something was seen there."""
        self._learned[self._near(place)] *= tuning.REFUTED_SHARE
        self._normalise()

    def scatter(self) -> None:
        """Update with a target that has moved: places that were looked at before may hold it now."""
        self._return_to_prior(tuning.MOVED_CHANCE)
        self._viewpoint = None

    def held_at(self, place: Point) -> float:
        """Return the probability that it is near a place."""
        return float(self._mass(self._near(place)).sum())

    def decay(self, passed_s: float) -> None:
        """Let the belief decay towards the prior."""
        share = 1.0 - math.exp(-passed_s / tuning.DECAY_S)
        self._return_to_prior(share)
        if self._viewpoint is not None:  # and belief that has come back may be looked for again
            self._viewpoint.missed = (1.0 - share) * self._viewpoint.missed + share
            self._viewpoint.left = (1.0 - share) * self._viewpoint.left + share

    def _return_to_prior(self, share: float) -> None:
        prior = share / (tuning.FACINGS * float(self._likely.sum()))
        self._learned = (1.0 - share) * self._learned + prior
        self._unlearned = (1.0 - share) * self._unlearned + prior

    def chance_from(self, x_mm: float, y_mm: float, floor: OccupancyGrid) -> float:
        """Return the probability that one scan from a place finds it."""
        return self.chances_from([(x_mm, y_mm)], floor)[0]

    def chances_from(self, viewpoints: Sequence[Point], floor: OccupancyGrid) -> list[float]:
        """Return for each viewpoint the probability that one scan from there finds it."""
        plausible = self._plausible_mass(floor)
        total = plausible.sum()
        return [float((self._gain(at, floor, plausible) / total).sum()) for at in viewpoints]

    def frontier_chances_from(self, viewpoints: Sequence[Point], floor: OccupancyGrid) -> list[float]:
        """Return for each viewpoint the probability that it is on unknown floor with nothing suspected in between.

        Looking round from the place does not show it, but that floor becomes known from there.
        """
        plausible = self._plausible(floor)
        mass = self._mass().sum(axis=1) * plausible
        unknown, total = plausible == tuning.UNKNOWN_PLAUSIBILITY, mass.sum()
        chances = []
        for x_mm, y_mm in viewpoints:
            near, distance, bearing_deg, _ = _seen_from(x_mm, y_mm, self.reach_mm, self._far_mm)
            free = _along(floor.visibility(x_mm, y_mm, tuning.FRONTIER_MM, tuning.FRONTIER_MM), distance, bearing_deg)
            beyond = unknown[near] & (distance <= tuning.FRONTIER_MM)
            chances.append(float((mass[near] * free)[beyond].sum() / total))
        return chances

    def arc_from(self, x_mm: float, y_mm: float, floor: OccupancyGrid, turn_deg_s: float) -> tuple[float, float]:
        """Return the arc of bearings with the best gain per time, from and to in degrees clockwise.

        Args:
            x_mm: Place of the robot, forward of the start.
            y_mm: Place of the robot, to the right of the start.
            floor: The map, for what may hide the target.
            turn_deg_s: How fast the robot turns while it looks.
        """
        plausible = self._plausible_mass(floor)
        gain = self._gain((x_mm, y_mm), floor, plausible) / plausible.sum()
        bearing_deg = np.degrees(np.arctan2(self._y - y_mm, self._x - x_mm)) % 360.0
        bins = np.bincount(
            (bearing_deg / tuning.ARC_STEP_DEG).astype(np.int64) % tuning.ARC_BINS,
            weights=gain,
            minlength=tuning.ARC_BINS,
        )
        if bins.sum() <= 0:
            return 0.0, 360.0
        sums = np.concatenate([[0.0], np.cumsum(np.concatenate([bins, bins]))])
        widths = np.arange(1, tuning.ARC_BINS + 1)
        held = np.stack([sums[width : width + tuning.ARC_BINS] - sums[: tuning.ARC_BINS] for width in widths])
        gain_per_s = held / (tuning.OVERHEAD_S + widths * tuning.ARC_STEP_DEG / turn_deg_s)[:, None]
        best, first = np.unravel_index(int(np.argmax(gain_per_s)), gain_per_s.shape)
        return float(first * tuning.ARC_STEP_DEG), float((first + widths[best]) * tuning.ARC_STEP_DEG)

    def _gain(self, at: Point, floor: OccupancyGrid, plausible: Array) -> Array:
        """Return how much of the plausible mass at each place a scan from here would find, (places,)."""
        view = self._view(*at, floor)
        missed = (1.0 - view.each) ** tuning.ROUND_FRAMES
        left: Array | float = 1.0
        if self._viewpoint is not None and math.dist(self._viewpoint.at, at) <= tuning.VIEWPOINT_MM:
            missed, left = self._viewpoint.missed[view.near] * missed, self._viewpoint.left[view.near]
        found = 1.0 - (1.0 - view.possible * np.minimum(tuning.MAX_FOUND_CHANCE, 1.0 - missed)[:, None]) / left
        gain = np.zeros(len(self._x))
        gain[view.near] = (plausible[view.near] * np.maximum(0.0, found)).sum(axis=1)
        return gain

    def _plausible_mass(self, floor: OccupancyGrid) -> Array:
        """Return the probability of each place and facing, weighed by how plausible it is, (places, facings)."""
        return self._mass() * self._plausible(floor)[:, None]

    def _view(self, x_mm: float, y_mm: float, floor: OccupancyGrid) -> _View:
        """Return what can be seen from a place, turning round."""
        near, distance, bearing_deg, by_slant = _seen_from(x_mm, y_mm, self.reach_mm, self._far_mm)
        share = distance / self._range_mm
        each = np.interp(
            share,
            [0.0, tuning.SURE_SHARE, tuning.POOR_SHARE, tuning.BLIND_SHARE],
            [1.0, 1.0, tuning.POOR_HIT_RATE, 0.0],
        )
        # the place itself is as large as the grid's spacing, and the picture echoes
        sight = _along(floor.visibility(x_mm, y_mm, self._range_mm), distance - tuning.SPACING_MM, bearing_deg)
        return _View((x_mm, y_mm), near, by_slant * sight[:, None], each, bearing_deg)

    def _plausible(self, floor: OccupancyGrid) -> Array:
        """Return how plausible a picture is at each place, as far as the map shows, (places,)."""
        if self._plausible_on is None or not np.array_equal(self._plausible_on[0], floor.log_odds):
            half = int(tuning.SPACING_MM / CELL_MM / 2)
            i, j = floor.cells.index(self._x), floor.cells.index(self._y)
            around = [(a, b) for a in range(-half, half + 1) for b in range(-half, half + 1)]
            patches = np.stack([floor.log_odds[i + a, j + b] for a, b in around])
            free = (patches < -HINT).mean(axis=0) > tuning.EMPTY_SHARE
            marked = (patches > HINT).any(axis=0)
            unknown = (np.abs(patches) < KNOWN).mean(axis=0) > tuning.UNKNOWN_SHARE
            plausible = np.where(
                free & ~marked, tuning.EMPTY_PLAUSIBILITY, np.where(unknown, tuning.UNKNOWN_PLAUSIBILITY, 1.0)
            )
            self._plausible_on = (floor.log_odds.copy(), plausible)
        return self._plausible_on[1]
