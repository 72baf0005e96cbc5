"""A lock that serves waiting threads in order, and those that preempt before the others.

A plain lock goes to the thread that is first to ask after it is free, which is often the thread that has just released
it. Here a command that stops a motor never waits for more than the one request that is being answered.
"""

from __future__ import annotations

import threading
from bisect import insort
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count

from firmware_protocol.direct import ResetMotorPosition, SetOutputState, UpdateResetCount
from firmware_protocol.errors import LinkTimeout
from firmware_protocol.system import IOMapWrite
from nxtdrive.link.threads import THREADS, Threads

PREEMPTING = (SetOutputState, IOMapWrite, ResetMotorPosition, UpdateResetCount)
"""Commands that drive motors; they overtake others that wait for the wire."""


@dataclass(slots=True, order=True)
class _Place:
    """A thread's place in the queue; the smallest is next."""

    ordinary: bool
    number: int
    called: threading.Event = field(compare=False, default_factory=threading.Event)


class PriorityLock:
    """The queue of threads in front of a link.

    Args:
        threads: How a thread waits.

    Attributes:
        queue: The waiting threads, next one first; empty while the link has one user.
        free: The lock itself. What must be fast takes it if the queue is empty, and calls `call_next` after its release
            if the queue is not.
    """

    def __init__(self, threads: Threads = THREADS) -> None:
        self.queue: list[_Place] = []
        self._threads = threads
        self.free = threading.Lock()
        self._mutex = threading.Lock()
        self._numbers = count()

    def acquire(self, preempting: bool, timeout_s: float | None = None) -> None:
        """Take the lock, after the threads that wait already, or with `preempting` before those that do not preempt.

        Raises:
            LinkTimeout: Others held it for `timeout_s`; without it there is no limit.
        """
        place = _Place(not preempting, next(self._numbers))
        with self._mutex:
            insort(self.queue, place)
        self.call_next()
        try:
            if self._threads.wait(place.called, timeout_s):
                return
        except BaseException:
            if not self._withdraw(place):
                self.release()
            raise
        if not self._withdraw(place):
            return  # called in this very moment
        raise LinkTimeout(
            f"other threads of this program kept the link busy for {timeout_s or 0:g} s.",
            remedy="Ask less often, or allow more time.",
        )

    def release(self) -> None:
        """Give the lock back; the next thread in the queue gets it."""
        self.free.release()
        if self.queue:
            self.call_next()

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Hold the lock for a block, before all ordinary requests."""
        if self.queue or not self.free.acquire(blocking=False):
            self.acquire(True)
        try:
            yield
        finally:
            self.release()

    def call_next(self) -> None:
        """Hand the lock, if it is free, to the first thread in the queue."""
        with self._mutex:
            if self.queue and self.free.acquire(blocking=False):
                self.queue.pop(0).called.set()

    def _withdraw(self, place: _Place) -> bool:
        """Leave the queue; returns False for a thread that was called meanwhile and has the lock."""
        with self._mutex:
            if place not in self.queue:
                return False
            self.queue.remove(place)
            return True
