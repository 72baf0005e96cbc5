"""A lock that serves waiting threads in order of priority and arrival.

A plain lock often goes back to the thread that has just released it. With this one, a command that stops a motor waits
for no more than the request in progress.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from operator import attrgetter
from typing import TypeVar, TypeVarTuple

from firmware_protocol.direct import ResetMotorPosition, SetOutputState, UpdateResetCount
from firmware_protocol.errors import LinkTimeout
from firmware_protocol.system import IOMapWrite
from nxtdrive.link.threads import THREADS, Threads

Args = TypeVarTuple("Args")
Result = TypeVar("Result")

PREEMPTING = (SetOutputState, IOMapWrite, ResetMotorPosition, UpdateResetCount)
"""Commands that drive motors; they go before other waiting commands."""
SLICE_S = 0.1
"""A waiting thread checks this often whether it is next, as an interrupted thread may not have woken it."""


@dataclass(slots=True, eq=False)
class _Waiter:
    """A waiting thread; the one of the smallest rank is next.

    Attributes:
        rank: 0 for a woken thread, 1 for a preempting one, 2 for others; and a number.
        woken: Set to wake the thread.
    """

    rank: tuple[int, int]
    woken: threading.Event = field(default_factory=threading.Event)


_RANK = attrgetter("rank")


class PriorityLock:
    """A lock with a queue, in front of a link.

    An exception that a signal handler raises, as Ctrl-C does, leaves it free: it is acquired within the `try` that
    releases it. CPython may call a handler when `acquire` has returned, but not between the beginning of a `finally`
    and `release`.

    Args:
        threads: Makes the lock, and lets a thread wait.

    Attributes:
        queue: The waiting threads; empty while only one thread uses the link.
        rlock: The lock itself, reentrant because only such a lock records its owner. Time-critical code may do inline
            what `exclusive` does.
    """

    def __init__(self, threads: Threads = THREADS) -> None:
        self.queue: list[_Waiter] = []
        self.rlock = threads.new_lock(reentrant=True)
        self._threads = threads
        self._numbers = count()

    def exclusive(
        self, work: Callable[[*Args], Result], *args: *Args, preempting: bool = True, timeout_s: float | None = None
    ) -> Result:
        """Call `work` with the lock held, after all waiting threads, or with `preempting` before those without it.

        Raises:
            LinkTimeout: Other threads held it for `timeout_s`; None: no limit.
        """
        try:
            if self.queue or not self.rlock.acquire(False):
                self.wait(preempting=preempting, timeout_s=timeout_s)
            return work(*args)
        finally:
            try:  # noqa: SIM105 - a handler may be called in `suppress`
                self.rlock.release()
            except RuntimeError:  # it was not acquired
                pass
            if self.queue:
                self.wake_next()

    def wait(self, *, preempting: bool, timeout_s: float | None) -> None:
        """Wait in the queue, and acquire the lock.

        Raises:
            LinkTimeout: As `exclusive`.
        """
        waiter = _Waiter((1 if preempting else 2, next(self._numbers)))
        end = math.inf if timeout_s is None else self._threads.now() + timeout_s
        try:
            self.queue.append(waiter)
            while True:
                waiter.woken.clear()
                if min(self.queue, key=_RANK) is waiter and self.rlock.acquire(False):
                    return
                left = end - self._threads.now()
                if left <= 0:
                    break
                self._threads.wait(waiter.woken, min(left, SLICE_S))
        finally:
            try:  # noqa: SIM105 - as in `exclusive`
                self.queue.remove(waiter)
            except ValueError:  # it was not appended
                pass
        raise LinkTimeout(
            f"other threads of this program kept the link busy for {timeout_s or 0:g} s.",
            remedy="Send requests less often, or allow more time.",
        )

    def wake_next(self) -> None:
        """Wake the first thread in the queue; no other overtakes it from now on."""
        first = min(self.queue, key=_RANK, default=None)
        if first is not None:
            first.rank = 0, 0
            first.woken.set()
