"""Detect programs that sleep on the wall clock, during which no simulated time passes."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import NamedTuple

try:
    from resource import RUSAGE_THREAD, getrusage
except ImportError:  # Windows and macOS do not count a thread's waits: no warning there
    getrusage = None  # type: ignore[assignment]

BLOCKED_S = 0.02
"""Shortest pause between two requests that counts as sleep."""
BUSY_SHARE = 0.05
"""A program that sleeps uses less than this share of the time; one that computes uses more, even under load."""
WAITS = 3
"""Maximum number of voluntary context switches of a sleep; work in a library's threads causes more."""
WARNED_S = 0.25
"""Total sleep at which to warn."""


class Usage(NamedTuple):
    """Resources that a program has used so far."""

    wall_s: float
    """Wall clock, seconds."""
    busy_s: float
    """Processor time of the whole process, seconds."""
    waits: int
    """Number of times this thread has waited."""
    preempted: int
    """Number of times another thread or process has taken this thread's processor."""


def _usage() -> Usage:
    if getrusage is None:
        return Usage(0.0, 0.0, 0, 0)
    thread = getrusage(RUSAGE_THREAD)
    return Usage(time.monotonic(), time.process_time(), thread.ru_nvcsw, thread.ru_nivcsw)


class SleepWarning:
    """Warns once of `time.sleep` in a simulation, where only `Brick.sleep` lets time pass.

    Args:
        usage: What the program has used so far.
    """

    def __init__(self, usage: Callable[[], Usage] = _usage) -> None:
        self._usage = usage
        self._slept_s = 0.0
        self._done = False
        self.leave()

    def leave(self) -> None:
        """Note that the simulation returns to the program."""
        if not self._done:
            self._left = self._usage()

    def enter(self, moving: Callable[[], bool]) -> None:
        """Note that the program calls the simulation again; `moving` is whether motors turn."""
        if self._done:
            return
        wall_s, busy_s, waits, preempted = (now - then for now, then in zip(self._usage(), self._left, strict=True))
        slept = wall_s >= BLOCKED_S and busy_s < BUSY_SHARE * wall_s and 0 < waits <= WAITS and not preempted
        if not slept or not moving():
            return
        self._slept_s += wall_s
        if self._slept_s >= WARNED_S:
            self._done = True
            warnings.warn(
                "the program sleeps while its simulated robot moves, but no simulated time passes meanwhile: "
                "use brick.sleep() instead of time.sleep(), or sim://?pace=realtime.",
                stacklevel=2,
            )
