"""Whether a wheel stands though it should turn."""

from __future__ import annotations

import math

STALL_S = 0.7
"""A wheel that has not moved for this time, though it should, is stalled."""
STALL_DEG = 2.0
"""Less than this is no motion: a wheel under load trembles."""
WATCH_S = 0.25
"""Longest time between two looks at a wheel that something might hold."""


class StallDetector:
    """Whether a wheel stands though it should turn, as seen in readings of it.

    Args:
        stall_s: It is stalled when it has not moved for this long.
    """

    def __init__(self, stall_s: float = STALL_S) -> None:
        self._stall_s = stall_s
        self._angle_deg = math.inf
        self._since_s = self._now_s = -math.inf

    def begin(self, time_s: float) -> None:
        """It was told to turn, or to turn otherwise; that it stood before does not count."""
        self._since_s = time_s

    def note(self, time_s: float, angle_deg: float) -> None:
        """Take one reading."""
        self._now_s = time_s
        if abs(angle_deg - self._angle_deg) > STALL_DEG:
            self._angle_deg, self._since_s = angle_deg, time_s

    @property
    def stalled(self) -> bool:
        """Whether it has stood too long."""
        return self._now_s - self._since_s > self._stall_s
