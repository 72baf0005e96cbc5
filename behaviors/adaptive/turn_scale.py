"""How far the robot really turns, from the echoes in a turn on the spot of more than 360 degrees.

An axle track measured with a ruler, a worn tyre or a smooth floor makes a robot turn a few per cent more or less than
its wheel counts say, and after a few scans its map is rotated. Beyond a full turn the sonar receives each echo again:
the angle between the two times, by the wheel counts, corresponds to 360 degrees.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from behaviors.ports import Pose

ENOUGH_DEG = 425.0
"""A turn this long, by the wheels, shows the scale if the echoes showed edges at its beginning."""
FURTHER_DEG = 15.0
"""Otherwise the turn continues by this much at a time."""
LONGEST_DEG = 485.0
"""Maximum length of the turn."""
MAX_ERROR = 0.15
"""Wheels are no farther off than this share: a track or diameter is measured by ruler, and some wheels slip."""
MIN_ERROR = 0.012
"""A smaller share may be an accident of the echoes, and is ignored."""
OVERLAP_DEG = 24.0
"""The arc that is measured twice must be at least this wide."""
STEP_DEG = 2.0
"""Echoes are compared this far apart; the sonar's beam is far wider."""
FARTHEST_MM = 2000.0
"""Echoes from farther away, and missing echoes, count as this."""
OUTLIER_MM = 150.0
"""A larger difference counts as this: something moved, or a beam just missed an edge."""
FITS_MM = 60.0
"""Echoes that differ by more in the mean do not fit."""
APART_DEG, DISTINCT_SHARE, DISTINCT_MM = 8.0, 0.6, 15.0
"""Scales that differ from the best one by more than `APART_DEG` in a turn must fit worse, by this share of its misfit
and by `DISTINCT_MM`: where nothing is near, every scale fits."""
MOVED_MM = 40.0
"""A robot that moved farther than this has not turned on the spot."""

Array = NDArray[np.float64]
Beam = tuple[Pose, float | None]
"""Where the robot was by its wheels, and the echo in mm or None."""


class TurnScale:
    """Collects the echoes of one turn on the spot."""

    def __init__(self) -> None:
        self._beams: list[Beam] = []

    @property
    def beams(self) -> tuple[Beam, ...]:
        """The echoes of the current turn, oldest first."""
        return tuple(self._beams)

    @property
    def turned_deg(self) -> float:
        """How far the robot has turned on the spot by its wheels, positive right."""
        return self._beams[-1][0].heading_deg - self._beams[0][0].heading_deg if self._beams else 0.0

    @property
    def complete(self) -> bool:
        """Whether the turn shows the scale of turns, or is too long to continue."""
        return abs(self.turned_deg) >= LONGEST_DEG or self.estimate() is not None

    def begin(self) -> None:
        """Begin with a new turn."""
        self._beams.clear()

    def add(self, pose: Pose, range_mm: float | None) -> None:
        """Add an echo, or None for a missing one; where the robot moved on, a new turn begins."""
        if self._beams and self._beams[0][0].distance_mm_to(pose) > MOVED_MM:
            self._beams.clear()
        self._beams.append((pose, range_mm))

    def estimate(self) -> float | None:
        """Return how many degrees the robot turns for each by its wheels; None if the echoes do not show it."""
        if abs(self.turned_deg) < ENOUGH_DEG:
            return None
        begin = self._beams[0][0].heading_deg
        headings = np.array([abs(pose.heading_deg - begin) for pose, _ in self._beams])
        ranges = np.array([FARTHEST_MM if each is None else min(each, FARTHEST_MM) for _, each in self._beams])
        order = np.argsort(headings, kind="stable")
        turns, misfits = _echo_differences(headings[order], ranges[order])
        if not len(turns):
            return None
        best = int(misfits.argmin())
        elsewhere = misfits[np.abs(turns - turns[best]) > APART_DEG]
        least_mm = misfits[best] + max(DISTINCT_SHARE * misfits[best], DISTINCT_MM)
        if misfits[best] > FITS_MM or elsewhere.min(initial=math.inf) < least_mm:
            return None
        scale = 360.0 / float(turns[best])
        return scale if abs(scale - 1.0) >= MIN_ERROR else 1.0


def corrected(pose: Pose, begin: Pose, scale: float) -> Pose:
    """Return a pose in a turn that was `scale` times as far as believed since it began."""
    return replace(pose, heading_deg=begin.heading_deg + scale * (pose.heading_deg - begin.heading_deg))


def _echo_differences(headings: Array, ranges: Array) -> tuple[Array, Array]:
    """Return full turns by the wheels that are possible, in degrees, and the mean difference of echoes for each, mm."""
    at = np.arange(headings[0], headings[-1], STEP_DEG)
    turns = np.arange(360.0 / (1 + MAX_ERROR), 360.0 / (1 - MAX_ERROR), STEP_DEG / 2)
    turns = turns[turns <= headings[-1] - headings[0] - OVERLAP_DEG]
    misfits = []
    for turn_deg in turns:
        first = at[at + turn_deg <= headings[-1]]
        apart = np.interp(first, headings, ranges) - np.interp(first + turn_deg, headings, ranges)
        misfits.append(np.minimum(np.abs(apart), OUTLIER_MM).mean())
    return turns, np.array(misfits)
