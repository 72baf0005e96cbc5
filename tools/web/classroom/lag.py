"""Whether a simulated robot runs slower than real time."""

from __future__ import annotations

from collections import deque
from threading import Lock

WINDOW_S, LAG_S = 10.0, 1.0
"""A robot whose clock loses more than `LAG_S` in the last `WINDOW_S` of real time is slow (docs/classroom.md)."""


class LagMeter:
    """Compares a robot's clock with real time; any thread."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._times: deque[tuple[float, float]] = deque()

    def reset(self) -> None:
        """Start over: the robot's clock stands still, or is another one."""
        with self._lock:
            self._times.clear()

    def lags(self, real_s: float, robot_s: float) -> bool:
        """Note both clocks; return whether the robot's fell behind by more than `LAG_S` in the last `WINDOW_S`."""
        with self._lock:
            times = self._times
            times.append((real_s, robot_s))
            while times[0][0] < real_s - WINDOW_S:
                times.popleft()
            return (real_s - times[0][0]) - (robot_s - times[0][1]) > LAG_S
