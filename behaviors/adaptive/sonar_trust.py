"""Whether the sonar works: one without an echo, or with always the same echo, is ignored."""

from __future__ import annotations

import math

from behaviors.angles import wrapped_deg
from behaviors.ports import Pose

SILENT_S = 5.0
"""A sonar without an echo for this time may be dead; in a room there is mostly something in range."""
STUCK_MM = 200.0
"""The same echo over a path of this length is not an echo; a sonar measures centimetres."""
STUCK_DEG = 40.0
"""So is the same echo over turns of this much in all."""
CERTAIN_DEG = 150.0
"""A sonar that repeats an echo while the robot turns by this from one heading to another is certainly stuck: a wall is
at the same distance over twice the beam at most, and a corner over little more."""
DOUBTED_DEG = 60.0
"""Over this much it is doubtful; a turn of `CERTAIN_DEG` decides."""
FRESH_ECHOES = 3
"""After this many different echoes it is trusted again."""


class SonarTrust:
    """Decides from the echoes of one mission whether the sonar works.

    Attributes:
        stopped: Whether the repeated echo has stopped the robot.
        stuck: Whether that echo is certainly none and must not stop the robot.
    """

    def __init__(self) -> None:
        self.stopped = self.stuck = False
        self._headings = 0.0, 0.0
        self._last_echo_s = -math.inf
        self._now_s = 0.0
        self._pose: Pose | None = None
        self._last_mm: float | None = None
        self._path_mm = self._turn_deg = 0.0
        self._fresh = FRESH_ECHOES

    @property
    def silent(self) -> bool:
        """Whether there has been no echo for some time: then a missing echo does not mean that the path is free."""
        return self._now_s - self._last_echo_s > SILENT_S

    @property
    def doubtful(self) -> bool:
        """Whether it holds the robot by an echo that no wall would give in all these directions; a corner might."""
        return self.stopped and not self.stuck and self._repeated_deg > DOUBTED_DEG

    @property
    def _repeated_deg(self) -> float:
        return self._headings[1] - self._headings[0]

    def accepted(self, now_s: float, pose: Pose, range_mm: float | None) -> float | None:
        """Update with an echo, or None for a missing one; return it, or None if it is not to be believed."""
        self._now_s = now_s
        if range_mm is None:
            return None
        if range_mm == self._last_mm and self._pose is not None:
            self._path_mm += self._pose.distance_mm_to(pose)
            self._turn_deg += abs(wrapped_deg(pose.heading_deg - self._pose.heading_deg))
            self._headings = min(self._headings[0], pose.heading_deg), max(self._headings[1], pose.heading_deg)
        else:
            self._path_mm = self._turn_deg = 0.0
            self._headings = pose.heading_deg, pose.heading_deg
            self.stopped = False
            self._fresh += 1
        self._pose, self._last_mm = pose, range_mm
        if self._path_mm > STUCK_MM or self._turn_deg > STUCK_DEG:
            self._fresh = 0
        self.stuck = (self.stuck and self._fresh < FRESH_ECHOES) or (self.stopped and self._repeated_deg > CERTAIN_DEG)
        if self._fresh < FRESH_ECHOES:
            return None
        self._last_echo_s = now_s
        return range_mm
