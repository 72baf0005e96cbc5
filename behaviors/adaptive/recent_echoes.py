"""The sonar's last beams: whether something stepped into a place that they showed to be free."""

from __future__ import annotations

import math
from collections import deque

from behaviors.angles import wrapped_deg
from behaviors.ports import Point, Pose

KEPT_S = 8.0
"""Beams are remembered this long."""
CORE_DEG = 10.0
"""A place within this angle of the beam's axis is well within the beam."""
ARC_DEG = 12.0
"""The source of an echo may be this far to either side of the axis."""
FARTHEST_MM = 1300.0
"""Beams say nothing about places farther away than this: small things give no echo from there."""
PAST_MM = 250.0
"""An echo from this much farther than a place says that the place is free; no echo may mean a slanted side."""
PASSING_BEAMS = 3
"""Number of such beams in a row that are needed."""


class RecentEchoes:
    """The echoes of the last seconds, with the poses at which they were received.

    Args:
        sonar_forward_mm: The sonar in front of the axle.
    """

    def __init__(self, sonar_forward_mm: float) -> None:
        self._sonar_forward_mm = sonar_forward_mm
        self._beams: deque[tuple[float, Pose, float]] = deque()

    def add(self, now_s: float, pose: Pose, range_mm: float | None) -> None:
        """Add the current echo; a missing echo says nothing, since slanted sides deflect the sound."""
        if range_mm is not None:
            self._beams.append((now_s, pose, range_mm))
        while self._beams and self._beams[0][0] < now_s - KEPT_S:
            self._beams.popleft()

    def appeared(self, pose: Pose, range_mm: float) -> bool:
        """Return whether the source of an echo came within the last seconds: all of its arc was free.

        `OccupancyGrid.appeared` says it of the whole mission.

        What stands still and comes into the beam as the robot turns was not in earlier beams.
        """
        distance_mm = self._sonar_forward_mm + range_mm
        return all(self._passed(pose.ahead(distance_mm, off_deg)) for off_deg in (-ARC_DEG, 0.0, ARC_DEG))

    def _passed(self, place: Point) -> bool:
        """Return whether several beams in a row went past this place."""
        passed = 0
        for _, pose, range_mm in self._beams:
            distance_mm = self._within(pose, place)
            if distance_mm is None:
                continue
            passed = passed + 1 if range_mm >= distance_mm + PAST_MM else 0
            if passed >= PASSING_BEAMS:
                return True
        return False

    def _within(self, pose: Pose, place: Point) -> float | None:
        """Return a place's distance from the sonar if it is well within its beam."""
        x_mm, y_mm = pose.ahead(self._sonar_forward_mm)
        dx, dy = place[0] - x_mm, place[1] - y_mm
        distance_mm = math.hypot(dx, dy)
        off_deg = abs(wrapped_deg(math.degrees(math.atan2(dy, dx)) - pose.heading_deg))
        return distance_mm if distance_mm <= FARTHEST_MM and off_deg <= CORE_DEG else None
