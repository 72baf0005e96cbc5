"""Detection of wheels that stand still although they should turn."""

from __future__ import annotations

import math

STALL_S = 0.7
"""A wheel that has not moved for this time although it should is stalled."""
STALL_DEG = 2.0
"""A smaller motion does not count: a wheel under load trembles."""
DEAD_STALLS = 3
"""A wheel that has stalled this often and never turned will not turn: its motor is not connected, or it is blocked."""
LOST_STALLS = 4
"""So will one that has stalled this often since it last turned, forwards and backwards: the cable came off. A wheel
that something holds turns a little one way or the other."""
LOST_ONE_WAY_STALLS = 12
"""So will one that has stalled this often since it last turned, always the same way: some programs drive it no other
way."""
WATCH_S = 0.25
"""Longest time between two readings of a wheel that may stall."""


class StallDetector:
    """Detects from readings of a wheel that it stands although it should turn.

    Args:
        stall_s: A wheel that has not moved for this time is stalled.

    Attributes:
        has_moved: Whether the wheel has ever turned.
    """

    def __init__(self, stall_s: float = STALL_S) -> None:
        self._stall_s = stall_s
        self._angle_deg = math.inf
        self._since_s = self._now_s = -math.inf
        self.has_moved = False
        self._stalls: list[bool] = []

    def restart(self, time_s: float) -> None:
        """Restart the timer: the wheel gets a new command at `time_s`, and its rest before does not count."""
        self._since_s = time_s

    def update(self, time_s: float, angle_deg: float) -> None:
        """Add a reading."""
        self._now_s = time_s
        if abs(angle_deg - self._angle_deg) > STALL_DEG:
            if math.isfinite(self._angle_deg):
                self.has_moved = True
                self._stalls.clear()
            self._angle_deg, self._since_s = angle_deg, time_s

    @property
    def stalled(self) -> bool:
        """Whether the wheel is stalled."""
        return self._now_s - self._since_s > self._stall_s

    def count(self, *, forward: bool) -> None:
        """Count a motion that ended because the wheel stalled, and which way it should have turned."""
        self._stalls.append(forward)

    @property
    def dead(self) -> bool:
        """Whether the wheel will not turn: see `DEAD_STALLS`, `LOST_STALLS` and `LOST_ONE_WAY_STALLS`."""
        if not self.has_moved:
            return len(self._stalls) >= DEAD_STALLS
        return len(self._stalls) >= (LOST_STALLS if len(set(self._stalls)) > 1 else LOST_ONE_WAY_STALLS)
