"""Odometry: where the robot is, by what its wheels' counters say."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

from behaviors.ports import Pose
from nxtdrive.motion.outputs import Sample

JUMP_DEG, JUMP_DEG_S = 180.0, 1200.0
"""Counts beyond these, and faster than any motor, were not turned: the counter was reset."""


@dataclass(frozen=True, slots=True)
class Trip:
    """What the wheels did in a while.

    Attributes:
        x_mm: Displacement on the map.
        y_mm: Displacement on the map.
        turned_deg: How far the robot has turned in all, positive right.
        driven_mm: How much way it has made, forward or back.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    turned_deg: float = 0.0
    driven_mm: float = 0.0

    @property
    def away_mm(self) -> float:
        """From where it began."""
        return math.hypot(self.x_mm, self.y_mm)


NOWHERE = Trip()


class Odometry:
    """Integrates the rotation of two wheels; may be used from several threads.

    Starting and stopping a program zeroes the counters (docs/firmware.md section 1, fact 4), and so does switching the
    brick off; such a jump is no motion.

    Args:
        mm_per_deg: Way of the robot for each degree of its wheels, negative if the motors are built in reversed.
        track_mm: Distance between the wheels.

    Attributes:
        pose: Where the robot is.
        trip: What it did since it was corrected.
        way_mm: How far its middle has driven in all, back counting negative.
        last: The latest reading.
        still_since_s: When the wheels were first read as they stand now.
    """

    def __init__(self, mm_per_deg: float, track_mm: float) -> None:
        self.pose = Pose()
        self.trip = NOWHERE
        self.way_mm = 0.0
        self.last: Sample | None = None
        self.still_since_s = math.inf
        self._mm_per_deg = mm_per_deg
        self._track_mm = track_mm
        self._lock = threading.Lock()

    def note(self, reading: Sample) -> bool:
        """Take one reading of the left and the right wheel: what they did since the last one is one arc.

        Returns:
            Whether it counts; not if a later one, read by another thread, came before it.
        """
        with self._lock:
            before = self.last
            if before is not None and reading.time_s < before.time_s:
                return False
            self.last = reading
            if before is None or reading.angles_deg != before.angles_deg:
                self.still_since_s = reading.time_s
            if before is not None:
                self._integrate(before, reading)
            return True

    def put(self, pose: Pose) -> None:
        """Call the present place `pose`."""
        with self._lock:
            self.pose = pose

    def correct(self, angle_deg: float) -> None:
        """Add `angle_deg` to the heading and begin a new trip."""
        with self._lock:
            self.pose = Pose(self.pose.x_mm, self.pose.y_mm, self.pose.heading_deg + angle_deg)
            self.trip = NOWHERE

    @property
    def rest_s(self) -> float:
        """For how long the wheels have stood, as far as they were read."""
        return 0.0 if self.last is None else self.last.time_s - self.still_since_s

    def _integrate(self, before: Sample, reading: Sample) -> None:
        steps = [now - then for now, then in zip(reading.angles_deg, before.angles_deg, strict=True)]
        if max(map(abs, steps)) > JUMP_DEG + JUMP_DEG_S * (reading.time_s - before.time_s):
            return
        left, right = (step * self._mm_per_deg for step in steps)
        way_mm, turned_deg = (left + right) / 2, math.degrees((left - right) / self._track_mm)
        pose, trip = self.pose, self.trip
        self.way_mm += way_mm
        x_mm, y_mm = pose.ahead(way_mm, turned_deg / 2)
        self.pose = Pose(x_mm, y_mm, pose.heading_deg + turned_deg)
        self.trip = Trip(
            trip.x_mm + x_mm - pose.x_mm,
            trip.y_mm + y_mm - pose.y_mm,
            trip.turned_deg + turned_deg,
            trip.driven_mm + abs(way_mm),
        )
