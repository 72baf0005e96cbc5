"""Recent poses of the robot."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque

from behaviors.ports import Pose

KEPT_S = 3.0
"""Poses are kept this long: far longer than a frame is under way."""
TURN_OVER_S = 0.2
"""The rate of a turn is measured over this time."""


class PoseHistory:
    """Recent poses, to look up where a frame was taken."""

    def __init__(self) -> None:
        self._poses: deque[tuple[float, Pose]] = deque()

    def add(self, time_s: float, pose: Pose) -> None:
        """Add the current pose."""
        self._poses.append((time_s, pose))
        while self._poses[0][0] < time_s - KEPT_S:
            self._poses.popleft()

    def clear(self) -> None:
        """Forget all poses, after the current one was corrected; the next call must be `add`."""
        self._poses.clear()

    def at(self, time_s: float) -> Pose:
        """Return the pose at a time, interpolated; before and after what is known, the oldest and the newest."""
        i = bisect_left(self._poses, time_s, key=lambda each: each[0])
        if i == 0:
            return self._poses[0][1]
        if i == len(self._poses):
            return self._poses[-1][1]
        (then_s, then), (now_s, now) = self._poses[i - 1], self._poses[i]
        share = (time_s - then_s) / (now_s - then_s)
        return Pose(
            then.x_mm + share * (now.x_mm - then.x_mm),
            then.y_mm + share * (now.y_mm - then.y_mm),
            then.heading_deg + share * (now.heading_deg - then.heading_deg),
        )

    def turn_deg_s(self, time_s: float) -> float:
        """Return how fast the robot was turning at a time, positive right."""
        then, now = self.at(time_s - TURN_OVER_S), self.at(time_s)
        return (now.heading_deg - then.heading_deg) / TURN_OVER_S
