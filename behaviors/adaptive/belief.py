"""Where a target may be: a probability for every place and facing, lowered by every look that did not see it.

A look that sees nothing speaks against the places it would have shown, as strongly as the detector is reliable at that
distance and angle. Far places, oblique ones and those behind something lose little; so a target that was merely missed
keeps its probability where it is, and one that is elsewhere gains it there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive.angles import wrapped_deg
from behaviors.adaptive.occupancy_grid import CELL_MM, CELLS, DIRECTIONS, HINT, KNOWN, Grid, OccupancyGrid
from behaviors.ports import Point, Pose

SPACING_MM, REACH_MM = 400.0, 6800.0
"""Between neighbouring places, and from the start to the farthest along each axis: within the floor map."""
FACINGS = 8
"""Directions in which a picture may face, 45 degrees apart."""
HALF_SLANT_DEG, SLANT_WIDTH_DEG = 52.0, 5.0
"""A picture seen more obliquely is found in less than half of the looks. Source: docs/vision.md section 1.2, 45
and 60 degrees aside; the grid of facings is coarse, hence the width."""
SURE = 0.95
"""No number of frames from one place speaks more strongly than this: what a detector misses, it misses again."""
STAND_MM = 350.0
"""Looks from places no farther apart than this are looks from one place."""
ROUND_FRAMES = 6
"""Frames that show each place when the robot looks round."""
SURE_SHARE, POOR_SHARE, POOR, BLIND_SHARE = 0.45, 0.95, 0.55, 1.05
"""Up to the first share of its range the detector is sure; from there on it gets worse, since nobody knows the light,
at the second it finds this much, and at the last nothing."""
EMPTY = 0.1
"""Where the sonar found nothing there is hardly a picture on a stand."""
UNKNOWN = 0.5
"""Where nothing is known there may be no floor at all; pictures are at what echoes, mostly."""
LIKELY_MM = 2500.0
"""Standard deviation of a target's place around the start: rooms end."""
OBLIQUE_DEG = 35.0
"""What looks narrow is seen at least so obliquely, give or take the grid of facings."""
STEEPEST_DEG = HALF_SLANT_DEG + 8.0
"""What is seen at all is seen no more obliquely than this."""
SCATTERS = 0.7
"""How likely something that vanished has moved."""
SPIKE_MM = 350.0
"""What was seen at a place is at one of the grid's places so near to it."""
REFUTED = 0.02
"""Share of the belief in a place that is left when it was found out not to be there."""
TRUST = 0.85
"""How much a sighting is believed to tell where the target is."""
RENEWS_S = 250.0
"""Things move: belief returns to where it began, by two thirds in this time."""
EMPTY_SHARE, UNKNOWN_SHARE = 0.8, 0.9
"""A place is empty, or unknown, when more than this share of the cells around it are."""
CAME_S = 9.0
"""What a look round costs besides the turn: coming here, and deciding."""
ARC_STEP_DEG, ARC_BINS = 10.0, 36
"""Arcs to look at are made of so many parts of so many degrees: the whole turn."""

_FACING_DEG = np.arange(FACINGS) * 360.0 / FACINGS

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _View:
    """What a place shows.

    Attributes:
        at: The place.
        possible: How likely a target can be found from here at all, (places, FACINGS): not too oblique, nothing before.
        each: Probability that one frame finds it, if it can be found, (places,).
        bearing_deg: Where it would be, (places,).
    """

    at: Point
    possible: Array
    each: Array
    bearing_deg: Array


@dataclass(slots=True)
class _Stand:
    """What was looked at from one place. What hides a target hides it in every frame, so frames are no new evidence.

    Attributes:
        at: The place.
        missed: Probability to have missed it in all frames so far although it can be found, (places,).
        left: By what the belief was lowered from here, (places, FACINGS).
    """

    at: Point
    missed: Array
    left: Array


class Belief:
    """Belief about one target, over (places, FACINGS).

    Args:
        range_mm: From how far its detector finds it in good light.
        half_view_deg: Half the camera's angle of view that can be relied on.
    """

    def __init__(self, range_mm: float, half_view_deg: float) -> None:
        self._range_mm = range_mm
        self._half_view_deg = half_view_deg
        axis = np.arange(-REACH_MM, REACH_MM + 1, SPACING_MM)
        self._x, self._y = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
        prior = np.repeat(np.exp(-(self._x**2 + self._y**2) / (2 * LIKELY_MM**2))[:, None], FACINGS, axis=1)
        self._prior = prior / prior.sum()
        self._mass = self._prior.copy()
        self._stand: _Stand | None = None
        self._plausible_on: tuple[Grid, Array] | None = None

    def look(self, pose: Pose, floor: OccupancyGrid, frames: int) -> None:
        """Take in that it was not seen in so many frames from a pose."""
        view = self._view(pose.x_mm, pose.y_mm, floor)
        if self._stand is None or math.dist(self._stand.at, view.at) > STAND_MM:
            self._stand = _Stand(view.at, np.ones(len(self._x)), np.ones_like(self._mass))
        stand = self._stand
        off_deg = np.abs(wrapped_deg(view.bearing_deg - pose.heading_deg))
        inside = off_deg <= self._half_view_deg
        stand.missed[inside] *= (1.0 - view.each[inside]) ** frames
        left = 1.0 - view.possible * np.minimum(SURE, 1.0 - stand.missed)[:, None]
        self._mass *= left / stand.left
        stand.left = left
        self._mass /= self._mass.sum()

    def see(self, place: Point, seen_from: Point, *, oblique: bool = False) -> None:
        """Take in that it was seen at a place, from another; `oblique` when it looked narrow."""
        near = np.hypot(self._x - place[0], self._y - place[1]) <= SPIKE_MM
        back_deg = math.degrees(math.atan2(seen_from[1] - place[1], seen_from[0] - place[0]))
        slant_deg = np.abs(wrapped_deg(_FACING_DEG - back_deg))
        facing = (slant_deg <= STEEPEST_DEG) & ((slant_deg >= OBLIQUE_DEG) | (not oblique))
        spike = near[:, None] & facing[None, :]
        if spike.any():  # odometry may have gone astray beyond the places that are considered
            self._mass *= 1.0 - TRUST
            self._mass[spike] += TRUST / int(spike.sum())
        self._stand = None  # what can be seen now is not hidden: to miss it from now on says something new

    def refute(self, place: Point) -> None:
        """Take in that it is not there, whatever it looked like."""
        near = np.hypot(self._x - place[0], self._y - place[1]) <= SPIKE_MM
        self._mass[near] *= REFUTED
        self._mass /= self._mass.sum()

    def scatter(self) -> None:
        """Take in that it is not there any more: it moved, and what was looked at before may hold it now."""
        self._mass = (1.0 - SCATTERS) * self._mass + SCATTERS * self._prior
        self._stand = None

    def held_at(self, place: Point) -> float:
        """Probability that it is near there."""
        near = np.hypot(self._x - place[0], self._y - place[1]) <= SPIKE_MM
        return float(self._mass[near].sum())

    def renew(self, passed_s: float) -> None:
        """Let time pass."""
        share = 1.0 - math.exp(-passed_s / RENEWS_S)
        self._mass = (1.0 - share) * self._mass + share * self._prior
        if self._stand is not None:  # and what has come back may be looked for again
            self._stand.missed = (1.0 - share) * self._stand.missed + share
            self._stand.left = (1.0 - share) * self._stand.left + share

    def chance_from(self, x_mm: float, y_mm: float, floor: OccupancyGrid) -> float:
        """Probability that one look round from there finds it."""
        return float(self._gain(x_mm, y_mm, floor).sum())

    def arc_from(self, x_mm: float, y_mm: float, floor: OccupancyGrid, turn_deg_s: float) -> tuple[float, float]:
        """The arc of bearings that is most worth being looked at, from and to in degrees clockwise.

        Args:
            x_mm: Where the robot is, forward of the start.
            y_mm: And to the right of it.
            floor: What may hide the target.
            turn_deg_s: How fast the robot turns while it looks.
        """
        gain = self._gain(x_mm, y_mm, floor)
        bearing_deg = np.degrees(np.arctan2(self._y - y_mm, self._x - x_mm)) % 360.0
        bins = np.bincount((bearing_deg / ARC_STEP_DEG).astype(np.int64) % ARC_BINS, weights=gain, minlength=ARC_BINS)
        if bins.sum() <= 0:
            return 0.0, 360.0
        sums = np.concatenate([[0.0], np.cumsum(np.concatenate([bins, bins]))])
        widths = np.arange(1, ARC_BINS + 1)
        held = np.stack([sums[width : width + ARC_BINS] - sums[:ARC_BINS] for width in widths])
        # what one gets for one's time, with the time it took to come here
        worth = held / (CAME_S + widths * ARC_STEP_DEG / turn_deg_s)[:, None]
        best, first = np.unravel_index(int(np.argmax(worth)), worth.shape)
        return float(first * ARC_STEP_DEG), float((first + widths[best]) * ARC_STEP_DEG)

    def _gain(self, x_mm: float, y_mm: float, floor: OccupancyGrid) -> Array:
        """Probability of finding it at each place by looking round from here, (places,)."""
        view = self._view(x_mm, y_mm, floor)
        missed, left = np.ones(len(self._x)), np.ones_like(self._mass)
        if self._stand is not None and math.dist(self._stand.at, view.at) <= STAND_MM:
            missed, left = self._stand.missed, self._stand.left
        missed = missed * (1.0 - view.each) ** ROUND_FRAMES
        found = 1.0 - (1.0 - view.possible * np.minimum(SURE, 1.0 - missed)[:, None]) / left
        plausible = self._mass * self._plausible(floor)[:, None]
        return np.asarray((plausible * np.maximum(0.0, found)).sum(axis=1) / plausible.sum())

    def _view(self, x_mm: float, y_mm: float, floor: OccupancyGrid) -> _View:
        """What can be seen from a place, turning round."""
        dx, dy = self._x - x_mm, self._y - y_mm
        distance = np.hypot(dx, dy)
        bearing_deg = np.degrees(np.arctan2(dy, dx))
        slant_deg = np.abs(wrapped_deg(_FACING_DEG[None, :] - (bearing_deg + 180.0)[:, None]))
        by_slant = 1.0 / (1.0 + np.exp((slant_deg - HALF_SLANT_DEG) / SLANT_WIDTH_DEG))
        share = distance / self._range_mm
        each = np.interp(share, [0.0, SURE_SHARE, POOR_SHARE, BLIND_SHARE], [1.0, 1.0, POOR, 0.0])
        sight = floor.sight(x_mm, y_mm, self._range_mm)
        direction = np.rint(bearing_deg * DIRECTIONS / 360.0).astype(np.int64) % DIRECTIONS
        # the place itself is as large as the grid's spacing, and the picture echoes
        step = np.clip((distance - SPACING_MM) / CELL_MM, 0, sight.shape[1] - 1).astype(np.int64)
        return _View((x_mm, y_mm), by_slant * sight[direction, step][:, None], each, bearing_deg)

    def _plausible(self, floor: OccupancyGrid) -> Array:
        """How likely a place may hold a picture at all, as far as the floor map tells, (places,)."""
        if self._plausible_on is None or not np.array_equal(self._plausible_on[0], floor.evidence):
            half = int(SPACING_MM / CELL_MM / 2)
            i = np.clip((self._x / CELL_MM).astype(np.int64) + CELLS // 2, half, CELLS - half - 1)
            j = np.clip((self._y / CELL_MM).astype(np.int64) + CELLS // 2, half, CELLS - half - 1)
            around = [(a, b) for a in range(-half, half + 1) for b in range(-half, half + 1)]
            patches = np.stack([floor.evidence[i + a, j + b] for a, b in around])
            free = (patches < -HINT).mean(axis=0) > EMPTY_SHARE
            marked = (patches > HINT).any(axis=0)
            unknown = (np.abs(patches) < KNOWN).mean(axis=0) > UNKNOWN_SHARE
            plausible = np.where(free & ~marked, EMPTY, np.where(unknown, UNKNOWN, 1.0))
            self._plausible_on = (floor.evidence.copy(), plausible)
        return self._plausible_on[1]
