"""Where a target may be: a probability for every place and facing, lowered by every look that did not see it.

A look that sees nothing speaks against the places it would have shown, as strongly as the detector is reliable at that
distance and angle. Far places, oblique ones and those behind something lose little; so a target that was merely missed
keeps its probability where it is, and one that is elsewhere gains it there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive.floor import CELL_MM, CELLS, DIRECTIONS, HINT, FloorMap
from behaviors.ports import Pose
from behaviors.recovery import Point

SPACING_MM = 400.0
REACH_MM = 6800.0
FACINGS = 8
HALF_SLANT_DEG, SLANT_WIDTH_DEG = 52.0, 5.0
"""A picture seen more obliquely is found in less than half of the looks. Source: docs/vision.md, slant; the grid of
facings is coarse, hence the width."""
SURE = 0.95
"""No number of frames from one place speaks more strongly than this: what a detector misses, it misses again."""
SURE_SHARE, POOR_SHARE, POOR = 0.45, 0.95, 0.55
"""Up to the first share of its range the detector is sure; from there on it gets worse, since nobody knows the light,
and at the second it finds this much."""
BEHIND = 0.3
"""What is behind something on the floor map may still be seen, over it or because the map is wrong."""
EMPTY = 0.1
"""Where the sonar found nothing there is hardly a picture on a stand."""
LIKELY_MM = 2500.0
"""Standard deviation of a target's place around the start: rooms end."""
SPIKE_MM = 350.0
TRUST = 0.85
"""How much a sighting is believed to tell where the target is."""
RENEWS_S = 250.0
"""Things move: belief returns to where it began in this time."""

Array = NDArray[np.float64]


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
        self._seen_from: tuple[tuple[float, float], Array, Array] | None = None
        self._empty_at: tuple[int, Array] | None = None

    def look(self, pose: Pose, floor: FloorMap, frames: int) -> None:
        """Take in that it was not seen in so many frames from here."""
        detect, bearing_deg = self._detected_from(pose.x_mm, pose.y_mm, floor)
        off_deg = np.abs((bearing_deg - pose.heading_deg + 180.0) % 360.0 - 180.0)
        inside = off_deg <= self._half_view_deg
        self._mass[inside] *= 1.0 - np.minimum(SURE, 1.0 - (1.0 - detect[inside]) ** frames)
        self._mass /= self._mass.sum()

    def see(self, place: Point, seen_from: Point) -> None:
        """Take in that it was seen there, from here."""
        near = np.hypot(self._x - place[0], self._y - place[1]) <= SPIKE_MM
        back_deg = math.degrees(math.atan2(seen_from[1] - place[1], seen_from[0] - place[0]))
        facing = np.abs((_FACING_DEG - back_deg + 180.0) % 360.0 - 180.0) <= HALF_SLANT_DEG
        spike = near[:, None] & facing[None, :]
        if spike.any():  # odometry may have gone astray beyond the places that are considered
            self._mass *= 1.0 - TRUST
            self._mass[spike] += TRUST / int(spike.sum())

    def refute(self, place: Point) -> None:
        """Take in that it is not there, whatever it looked like."""
        near = np.hypot(self._x - place[0], self._y - place[1]) <= SPIKE_MM
        self._mass[near] *= 0.02
        self._mass /= self._mass.sum()

    def renew(self, passed_s: float) -> None:
        """Let time pass."""
        share = 1.0 - math.exp(-passed_s / RENEWS_S)
        self._mass = (1.0 - share) * self._mass + share * self._prior

    def chance_from(self, x_mm: float, y_mm: float, floor: FloorMap) -> float:
        """Probability that one look round from there finds it."""
        return float(self._gain(x_mm, y_mm, floor).sum())

    def arc_from(self, x_mm: float, y_mm: float, floor: FloorMap, share: float) -> tuple[float, float]:
        """The smallest arc of bearings, from and to in degrees clockwise, that holds a share of what can be found."""
        gain = self._gain(x_mm, y_mm, floor)
        bearing_deg = np.degrees(np.arctan2(self._y - y_mm, self._x - x_mm)) % 360.0
        bins = np.bincount((bearing_deg / ARC_STEP_DEG).astype(np.int64) % ARC_BINS, weights=gain, minlength=ARC_BINS)
        if bins.sum() <= 0:
            return 0.0, 360.0
        twice = np.concatenate([[0.0], np.cumsum(np.concatenate([bins, bins]))])
        for width in range(1, ARC_BINS):
            held = twice[width : width + ARC_BINS] - twice[:ARC_BINS]
            first = int(np.argmax(held))
            if held[first] >= share * bins.sum():
                return first * ARC_STEP_DEG, (first + width) * ARC_STEP_DEG
        return 0.0, 360.0

    def _gain(self, x_mm: float, y_mm: float, floor: FloorMap) -> Array:
        """Probability of finding it at each place by looking round from here."""
        detect, _ = self._detected_from(x_mm, y_mm, floor)
        plausible = self._mass * self._plausible(floor)[:, None]
        return np.asarray((plausible * np.minimum(SURE, 1.0 - (1.0 - detect) ** 4)).sum(axis=1) / plausible.sum())

    def _detected_from(self, x_mm: float, y_mm: float, floor: FloorMap) -> tuple[Array, Array]:
        """Probability of a detection in one frame that shows the place, (places, FACINGS); and bearings, degrees."""
        if self._seen_from is not None and math.dist(self._seen_from[0], (x_mm, y_mm)) < 30.0:
            return self._seen_from[1], self._seen_from[2]
        dx, dy = self._x - x_mm, self._y - y_mm
        distance = np.hypot(dx, dy)
        bearing_deg = np.degrees(np.arctan2(dy, dx))
        slant_deg = np.abs((_FACING_DEG[None, :] - (bearing_deg + 180.0)[:, None] + 180.0) % 360.0 - 180.0)
        by_slant = 1.0 / (1.0 + np.exp((slant_deg - HALF_SLANT_DEG) / SLANT_WIDTH_DEG))
        share = distance / self._range_mm
        by_range = np.interp(share, [0.0, SURE_SHARE, POOR_SHARE, 1.05], [1.0, 1.0, POOR, 0.0])
        reach_mm = floor.reach_mm(x_mm, y_mm, self._range_mm)
        free_mm = reach_mm[np.rint(bearing_deg * DIRECTIONS / 360.0).astype(np.int64) % DIRECTIONS]
        by_sight = np.where(distance <= free_mm + SPACING_MM, 1.0, BEHIND)
        detect = by_slant * (by_range * by_sight)[:, None]
        self._seen_from = ((x_mm, y_mm), detect, bearing_deg)
        return detect, bearing_deg

    def _plausible(self, floor: FloorMap) -> Array:
        """Which places may hold a picture at all."""
        stamp = int(floor.evidence.sum() * 10)
        if self._empty_at is None or self._empty_at[0] != stamp:
            half = int(SPACING_MM / CELL_MM / 2)
            i = np.clip((self._x / CELL_MM).astype(np.int64) + CELLS // 2, half, CELLS - half - 1)
            j = np.clip((self._y / CELL_MM).astype(np.int64) + CELLS // 2, half, CELLS - half - 1)
            around = [(a, b) for a in range(-half, half + 1) for b in range(-half, half + 1)]
            patches = np.stack([floor.evidence[i + a, j + b] for a, b in around])
            free = (patches < -HINT).mean(axis=0) > 0.8
            marked = (patches > HINT).any(axis=0)
            self._empty_at = (stamp, np.where(free & ~marked, EMPTY, 1.0))
        return self._empty_at[1]


ARC_STEP_DEG = 10.0
ARC_BINS = 36
_FACING_DEG = np.arange(FACINGS) * 360.0 / FACINGS
