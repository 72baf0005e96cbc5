"""Frames in which the floor right ahead was free, since the robot has driven over it afterwards."""

from __future__ import annotations

from collections import deque

from behaviors.ports import Pose

FLOOR_MM = 700.0
"""The colours of the floor are learned from the lower edge of a frame, which shows it up to here from the axle."""
STRAIGHT_DEG = 5.0
"""A robot that turned by more than this did not drive where it looked before."""


class DrivenFloor:
    """Recent frames of a robot that drives straight ahead."""

    def __init__(self) -> None:
        self._frames: deque[tuple[float, Pose]] = deque()

    def add(self, time_s: float, pose: Pose) -> float | None:
        """Add a frame.

        Args:
            time_s: When it was taken, on the mission's clock; not before the frame added last.
            pose: Where the robot is.

        Returns:
            When the latest frame was taken whose floor right ahead the robot has driven over since the last call; None
            without one.
        """
        if self._frames and not _drove_on(self._frames[0][1], self._frames[-1][1], pose):
            self._frames.clear()
        self._frames.append((time_s, pose))
        free_at_s = None
        while self._frames[0][1].distance_mm_to(pose) >= FLOOR_MM:
            free_at_s, _ = self._frames.popleft()
        return free_at_s


def _drove_on(first: Pose, last: Pose, pose: Pose) -> bool:
    """Return whether a robot drove straight ahead from the first to the last of some poses, and on to a further one."""
    bearing_deg, now_mm = first.polar_to(pose.point)
    ahead = now_mm == 0.0 or abs(bearing_deg) < 90.0
    return ahead and now_mm >= first.distance_mm_to(last) and abs(pose.heading_deg - first.heading_deg) <= STRAIGHT_DEG
