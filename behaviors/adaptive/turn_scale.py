"""How far the robot really turns, from the echoes in a turn on the spot of more than 360 degrees.

An axle track measured with a ruler, a worn tyre or a smooth floor makes a robot turn a few per cent more or less than
its wheel counts say, and after a few scans its map is rotated. Beyond a full turn the sonar receives each echo again:
the angle between the two times, by the wheel counts, corresponds to 360 degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from behaviors.ports import Pose


@dataclass(frozen=True, slots=True)
class TurnTuning:
    """Tuning constants of the estimate.

    Attributes:
        enough_deg: A turn this long, by the wheels, shows the scale if the echoes showed edges at its beginning.
        further_deg: Otherwise the turn continues by this much at a time.
        longest_deg: Maximum length of the turn.
        most: Wheels are no farther off than this share: a track or diameter is measured by ruler, and some wheels slip.
        least: A smaller share may be an accident of the echoes, and is ignored.
        overlap_deg: The arc that is measured twice must be at least this wide.
        step_deg: Echoes are compared this far apart; the sonar's beam is far wider.
        farthest_mm: Echoes from farther away, and missing echoes, count as this.
        outlier_mm: A larger difference counts as this: something moved, or a beam just missed an edge.
        fits_mm: Echoes that differ by more in the mean do not fit.
        distinct: Scales that differ from the best one by more than `apart_deg` in a turn must fit worse by this share
            of its misfit, and by `distinct_mm`.
        distinct_mm: See `distinct`; where nothing is near, every scale fits.
        apart_deg: See `distinct`.
        moved_mm: A robot that moved farther than this has not turned on the spot.
    """

    enough_deg: float = 425.0
    further_deg: float = 15.0
    longest_deg: float = 485.0
    most: float = 0.15
    least: float = 0.012
    overlap_deg: float = 24.0
    step_deg: float = 2.0
    farthest_mm: float = 2000.0
    outlier_mm: float = 150.0
    fits_mm: float = 60.0
    distinct: float = 0.6
    distinct_mm: float = 15.0
    apart_deg: float = 8.0
    moved_mm: float = 40.0


TUNING = TurnTuning()

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
        return abs(self.turned_deg) >= TUNING.longest_deg or self.estimate() is not None

    def begin(self) -> None:
        """Begin with a new turn."""
        self._beams.clear()

    def add(self, pose: Pose, range_mm: float | None) -> None:
        """Add an echo, or None for a missing one; where the robot moved on, a new turn begins."""
        if self._beams and self._beams[0][0].distance_mm_to(pose) > TUNING.moved_mm:
            self._beams.clear()
        self._beams.append((pose, range_mm))

    def estimate(self) -> float | None:
        """Return how many degrees the robot turns for each by its wheels; None if the echoes do not show it."""
        if abs(self.turned_deg) < TUNING.enough_deg:
            return None
        begin = self._beams[0][0].heading_deg
        headings = np.array([abs(pose.heading_deg - begin) for pose, _ in self._beams])
        ranges = np.array(
            [TUNING.farthest_mm if each is None else min(each, TUNING.farthest_mm) for _, each in self._beams]
        )
        order = np.argsort(headings, kind="stable")
        turns, misfits = _echo_differences(headings[order], ranges[order])
        if not len(turns):
            return None
        best = int(misfits.argmin())
        elsewhere = misfits[np.abs(turns - turns[best]) > TUNING.apart_deg]
        least_mm = misfits[best] + max(TUNING.distinct * misfits[best], TUNING.distinct_mm)
        if misfits[best] > TUNING.fits_mm or elsewhere.min(initial=math.inf) < least_mm:
            return None
        scale = 360.0 / float(turns[best])
        return scale if abs(scale - 1.0) >= TUNING.least else 1.0


def corrected(pose: Pose, begin: Pose, scale: float) -> Pose:
    """Return a pose in a turn that was `scale` times as far as believed since it began."""
    return replace(pose, heading_deg=begin.heading_deg + scale * (pose.heading_deg - begin.heading_deg))


def _echo_differences(headings: Array, ranges: Array) -> tuple[Array, Array]:
    """Return full turns by the wheels that are possible, in degrees, and the mean difference of echoes for each, mm."""
    at = np.arange(headings[0], headings[-1], TUNING.step_deg)
    turns = np.arange(360.0 / (1 + TUNING.most), 360.0 / (1 - TUNING.most), TUNING.step_deg / 2)
    turns = turns[turns <= headings[-1] - headings[0] - TUNING.overlap_deg]
    misfits = []
    for turn_deg in turns:
        first = at[at + turn_deg <= headings[-1]]
        apart = np.interp(first, headings, ranges) - np.interp(first + turn_deg, headings, ranges)
        misfits.append(np.minimum(np.abs(apart), TUNING.outlier_mm).mean())
    return turns, np.array(misfits)
