"""Detection of wheels that stand still although they should turn."""

from __future__ import annotations

import math

STALL_S = 0.7
"""A wheel that has not moved for this time although it should is stalled."""
STALL_DEG = 2.0
"""A smaller motion does not count: a wheel under load trembles."""
DEAD_STALLS = 3
"""A wheel that has stalled this often and never turned will not turn: its motor is not connected, or it is blocked."""
WATCH_S = 0.25
"""Longest time between two readings of a wheel that may stall."""


class StallDetector:
    """Detects from readings of a wheel that it stands although it should turn.

    Args:
        stall_s: A wheel that has not moved for this time is stalled.
    """

    def __init__(self, stall_s: float = STALL_S) -> None:
        self._stall_s = stall_s
        self._angle_deg = math.inf
        self._since_s = self._now_s = -math.inf
        self._has_moved, self._stalls = False, 0

    def restart(self, time_s: float) -> None:
        """Restart the timer: the wheel gets a new command at `time_s`, and its rest before does not count."""
        self._since_s = time_s

    def update(self, time_s: float, angle_deg: float) -> None:
        """Add a reading."""
        self._now_s = time_s
        if abs(angle_deg - self._angle_deg) > STALL_DEG:
            self._has_moved |= math.isfinite(self._angle_deg)
            self._angle_deg, self._since_s = angle_deg, time_s

    @property
    def stalled(self) -> bool:
        """Whether the wheel is stalled."""
        return self._now_s - self._since_s > self._stall_s

    def count(self) -> None:
        """Count a motion that ended because the wheel stalled."""
        self._stalls += 1

    @property
    def dead(self) -> bool:
        """Whether the wheel has stalled `DEAD_STALLS` times and never moved."""
        return not self._has_moved and self._stalls >= DEAD_STALLS
