"""A lock that serves waiting threads in order of priority and arrival.

A plain lock often goes back to the thread that has just released it. With this one, a command that stops a motor waits
for no more than the request in progress.
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
"""Commands that drive motors; they go before other waiting commands."""


@dataclass(slots=True, order=True)
class _Place:
    """A thread's place in the queue; the smallest is next."""

    ordinary: bool
    number: int
    called: threading.Event = field(compare=False, default_factory=threading.Event)


class PriorityLock:
    """A lock with a queue, in front of a link.

    Args:
        threads: Lets a thread wait.

    Attributes:
        queue: The waiting threads, next one first; empty while only one thread uses the link.
        free: The lock itself. Time-critical code may acquire it directly if the queue is empty, and must call
            `call_next` after releasing it if the queue is not.
    """

    def __init__(self, threads: Threads = THREADS) -> None:
        self.queue: list[_Place] = []
        self._threads = threads
        self.free = threading.Lock()
        self._mutex = threading.Lock()
        self._numbers = count()

    def acquire(self, *, preempting: bool, timeout_s: float | None = None) -> None:
        """Acquire the lock after all waiting threads, or with `preempting` before those that are not.

        Raises:
            LinkTimeout: Other threads held it for `timeout_s`; None: no limit.
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
            return  # called at the last moment
        raise LinkTimeout(
            f"other threads of this program kept the link busy for {timeout_s or 0:g} s.",
            remedy="Ask less often, or allow more time.",
        )

    def release(self) -> None:
        """Release the lock to the next thread in the queue."""
        self.free.release()
        if self.queue:
            self.call_next()

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Hold the lock for a block, ahead of ordinary requests."""
        if self.queue or not self.free.acquire(blocking=False):
            self.acquire(preempting=True)
        try:
            yield
        finally:
            self.release()

    def call_next(self) -> None:
        """Give the lock, if it is free, to the first thread in the queue."""
        with self._mutex:
            if self.queue and self.free.acquire(blocking=False):
                self.queue.pop(0).called.set()

    def _withdraw(self, place: _Place) -> bool:
        """Leave the queue; return False if the thread has been called since and holds the lock."""
        with self._mutex:
            if place not in self.queue:
                return False
            self.queue.remove(place)
            return True
