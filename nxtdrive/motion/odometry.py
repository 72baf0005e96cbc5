"""Odometry: the robot's pose from the counters of its wheels."""

from __future__ import annotations

import math
import threading
from dataclasses import asdict, dataclass

from behaviors.ports import Pose
from nxtdrive.motion.lease import LEASE_S
from nxtdrive.motion.outputs import Sample
from nxtdrive.motion.wheel_geometry import WheelGeometry
from nxtdrive.ports import in_range, of_type

JUMP_DEG, JUMP_DEG_S = 180.0, 1200.0
"""A jump beyond these, faster than any motor, means that the counter was reset."""
RESET_DEG = 10.0
"""A step beyond this that ends with both counters at zero means the same; turning wheels rarely pass it together."""
POSE_RANGE = 1e6
"""Millimetres or degrees; a pose beyond it is a mistake."""


@dataclass(frozen=True, slots=True)
class OdometryDelta:
    """Motion since some moment, by the wheels.

    Attributes:
        x_mm: Displacement on the map.
        y_mm: Displacement on the map.
        turned_deg: Sum of all turns, positive right.
        driven_mm: Length of the path, forward or back.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    turned_deg: float = 0.0
    driven_mm: float = 0.0

    @property
    def away_mm(self) -> float:
        """Distance from where it began."""
        return math.hypot(self.x_mm, self.y_mm)


NO_MOTION = OdometryDelta()


class Odometry:
    """Integrates the rotation of two wheels; may be used from several threads.

    Starting and stopping a program zeroes the counters (docs/firmware.md section 1, fact 4), and so does switching the
    brick off; such a jump is not motion.

    Args:
        wheels: Their sizes and how they are mounted.

    Attributes:
        pose: Where the robot is.
        since_correction: Its motion since the last correction of the heading.
        distance_mm: Distance driven by the middle between the wheels, back counting negative.
        last: The latest reading.
        still_since_s: Time of the first reading with the current counts.
    """

    def __init__(self, wheels: WheelGeometry) -> None:
        self.pose = Pose()
        self.since_correction = NO_MOTION
        self.distance_mm = 0.0
        self.last: Sample | None = None
        self.still_since_s = math.inf
        self._wheels = wheels
        self._jumps_deg = 0.0
        self._lock = threading.Lock()

    def update(self, reading: Sample) -> bool:
        """Add a reading of the left and the right wheel; the motion since the last one counts as an arc.

        Returns:
            Whether it was used; not if another thread has added a later one before.
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

    def set_pose(self, pose: Pose) -> None:
        """Set the pose.

        Raises:
            LocalProtocolError: It is not a pose, or a value is not a number up to `POSE_RANGE` either way.
        """
        for name, value in asdict(of_type("pose", pose, Pose)).items():
            in_range(name, value, -POSE_RANGE, POSE_RANGE)
        with self._lock:
            self._jumps_deg += pose.heading_deg - self.pose.heading_deg
            self.pose = pose

    def correct(self, angle_deg: float, wheels: WheelGeometry | None = None, *, moved_mm: float = 0.0) -> None:
        """Add `angle_deg` to the heading, and `moved_mm` along it to the position.

        A new `since_correction` begins, and other `wheels`, if given, are used from now on.
        """
        with self._lock:
            self._wheels = wheels or self._wheels
            self.pose = self.pose.corrected(angle_deg, moved_mm)
            self.since_correction = NO_MOTION

    @property
    def turned_deg(self) -> float:
        """How far it has turned, corrections included; `set_pose` is not a turn."""
        return self.pose.heading_deg - self._jumps_deg

    @property
    def rest_s(self) -> float:
        """How long the wheels have stood still, by the readings."""
        return 0.0 if self.last is None else self.last.time_s - self.still_since_s

    def _integrate(self, before: Sample, reading: Sample) -> None:
        steps = [now - then for now, then in zip(reading.angles_deg, before.angles_deg, strict=True)]
        longest_deg = RESET_DEG
        if any(reading.angles_deg):
            duration_s = reading.time_s - before.time_s
            if reading.transport is not before.transport:  # while the link was lost, the motors turned for one lease
                duration_s = min(duration_s, LEASE_S)
            longest_deg = JUMP_DEG + JUMP_DEG_S * duration_s
        if max(map(abs, steps)) > longest_deg:
            return
        left, right = (step * mm for step, mm in zip(steps, self._wheels.mm_per_count, strict=True))
        distance_mm, turned_deg = (left + right) / 2, math.degrees((left - right) / self._wheels.track_mm)
        pose, delta = self.pose, self.since_correction
        self.distance_mm += distance_mm
        x_mm, y_mm = pose.ahead(distance_mm, turned_deg / 2)
        self.pose = Pose(x_mm, y_mm, pose.heading_deg + turned_deg)
        self.since_correction = OdometryDelta(
            delta.x_mm + x_mm - pose.x_mm,
            delta.y_mm + y_mm - pose.y_mm,
            delta.turned_deg + turned_deg,
            delta.driven_mm + abs(distance_mm),
        )
