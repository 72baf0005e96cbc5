"""In which frames the floor right ahead was free: where the robot has driven since then."""

from __future__ import annotations

from collections import deque

from behaviors.ports import Pose

FLOOR_MM = 700.0
"""A frame shows the floor right ahead up to here from the axle, as far as its colours are learned."""
STRAIGHT_DEG = 5.0
"""A robot that turned farther did not drive where it looked before."""


class DrivenFloor:
    """Recent frames of a robot that drives straight ahead."""

    def __init__(self) -> None:
        self._frames: deque[tuple[float, Pose]] = deque()

    def add(self, time_s: float, pose: Pose) -> float | None:
        """Add a frame.

        Args:
            time_s: When it was taken.
            pose: The robot's.

        Returns:
            When the latest earlier frame was taken whose floor right ahead the robot has driven over; None without one.
        """
        if self._frames and not _drove_on(self._frames[0][1], self._frames[-1][1], pose):
            self._frames.clear()
        self._frames.append((time_s, pose))
        free_at_s = None
        while self._frames[0][1].polar_to((pose.x_mm, pose.y_mm))[1] >= FLOOR_MM:
            free_at_s, _ = self._frames.popleft()
        return free_at_s


def _drove_on(first: Pose, last: Pose, pose: Pose) -> bool:
    """Return whether a robot drove straight ahead from the first to the last of some poses, and on to a further one."""
    before_mm, now_mm = (first.polar_to((each.x_mm, each.y_mm))[1] for each in (last, pose))
    return now_mm >= before_mm and abs(pose.heading_deg - first.heading_deg) <= STRAIGHT_DEG
