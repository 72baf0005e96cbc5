"""Whether the sonar works: one without an echo, or with always the same echo, is ignored."""

from __future__ import annotations

import math
from dataclasses import dataclass

from behaviors.angles import wrapped_deg
from behaviors.ports import Pose


@dataclass(frozen=True, slots=True)
class SonarTuning:
    """Tuning constants of the test of a sonar.

    Attributes:
        silent_s: A sonar without an echo for this time may be dead; in a room there is mostly something in range.
        stuck_mm: The same echo over a path of this length is not an echo; a sonar measures centimetres.
        stuck_deg: So is the same echo over turns of this much in all.
        certain_deg: A sonar that repeats an echo while the robot turns by this from one heading to another is certainly
            stuck: a wall is at the same distance over twice the beam at most, and a corner over little more.
        doubted_deg: Over this much it is doubtful; a turn of `certain_deg` decides.
        fresh: After this many different echoes it is trusted again.
    """

    silent_s: float = 5.0
    stuck_mm: float = 200.0
    stuck_deg: float = 40.0
    certain_deg: float = 150.0
    doubted_deg: float = 60.0
    fresh: int = 3


TUNING = SonarTuning()


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
        self._fresh = TUNING.fresh

    @property
    def silent(self) -> bool:
        """Whether there has been no echo for some time: then a missing echo does not mean that the path is free."""
        return self._now_s - self._last_echo_s > TUNING.silent_s

    @property
    def doubtful(self) -> bool:
        """Whether it holds the robot by an echo that no wall would give in all these directions; a corner might."""
        return self.stopped and not self.stuck and self._repeated_deg > TUNING.doubted_deg

    @property
    def _repeated_deg(self) -> float:
        return self._headings[1] - self._headings[0]

    def accepted(self, now_s: float, pose: Pose, range_mm: float | None) -> float | None:
        """Return an echo, or None if there is none or the sonar is stuck."""
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
        if self._path_mm > TUNING.stuck_mm or self._turn_deg > TUNING.stuck_deg:
            self._fresh = 0
        self.stuck = (self.stuck and self._fresh < TUNING.fresh) or (
            self.stopped and self._repeated_deg > TUNING.certain_deg
        )
        if self._fresh < TUNING.fresh:
            return None
        self._last_echo_s = now_s
        return range_mm
