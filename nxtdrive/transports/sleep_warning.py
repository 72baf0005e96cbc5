"""Detects programs that sleep on the wall clock, during which no simulated time passes."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable

try:
    from resource import RUSAGE_THREAD, getrusage
except ImportError:  # not on every system
    getrusage = None  # type: ignore[assignment]

BLOCKED_S = 0.02
"""Shortest pause between two requests that counts as sleep."""
WARNED_S = 0.25
"""Total sleep at which to warn."""


class SleepWarning:
    """Warns once about `time.sleep` in a simulation, where only `Brick.sleep` lets time pass.

    Sleep differs from computing by the processor time of the thread, and from waiting for a busy processor by a
    voluntary context switch, where the system counts these.
    """

    def __init__(self) -> None:
        self._slept_s = 0.0
        self._done = False
        self.leave()

    def leave(self) -> None:
        """Note that the simulation returns to the program."""
        if not self._done:
            self._left = _clocks()

    def enter(self, moving: Callable[[], bool]) -> None:
        """Note that the program calls the simulation again; `moving` tells whether motors turn."""
        if self._done:
            return
        wall_s, busy_s, rests = (now - then for now, then in zip(_clocks(), self._left, strict=True))
        if wall_s < BLOCKED_S or busy_s > wall_s / 2 or not rests or not moving():
            return
        self._slept_s += wall_s
        if self._slept_s >= WARNED_S:
            self._done = True
            warnings.warn(
                "the program sleeps while its simulated robot moves, but no simulated time passes meanwhile: "
                "use brick.sleep() instead of time.sleep(), or sim://?pace=realtime.",
                stacklevel=2,
            )


def _clocks() -> tuple[float, float, int]:
    """Return wall clock, processor time of this thread, and its number of voluntary context switches."""
    rests = getrusage(RUSAGE_THREAD).ru_nvcsw if getrusage is not None else time.monotonic_ns()
    return time.monotonic(), time.thread_time(), rests
