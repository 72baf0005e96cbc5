"""Notices a program that sleeps on the wall clock while its simulated robot stands still in time."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable

try:
    from resource import RUSAGE_THREAD, getrusage
except ImportError:  # not on every system
    getrusage = None  # type: ignore[assignment]

BLOCKED_S = 0.02
"""A program that rests for this time between two requests has slept, and not merely computed."""
WARNED_S = 0.25
"""Such rests, added up, that are worth a warning."""


class SleepWarning:
    """Warns once of `time.sleep` in a simulation, where only `Brick.sleep` lets time pass.

    Sleep is told from computing by the thread's processor time, and from a busy computer by the thread having given its
    processor up by itself, where the system tells that.
    """

    def __init__(self) -> None:
        self._slept_s = 0.0
        self._done = False
        self.leave()

    def leave(self) -> None:
        """The program goes on by itself."""
        if not self._done:
            self._left = _clocks()

    def enter(self, moving: Callable[[], bool]) -> None:
        """The program is back; `moving` tells whether motors turn."""
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
    """Wall clock, processor time of this thread, and how often it has waited for something."""
    rests = getrusage(RUSAGE_THREAD).ru_nvcsw if getrusage is not None else time.monotonic_ns()
    return time.monotonic(), time.thread_time(), rests
