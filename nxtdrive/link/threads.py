"""Threads and locks of a link, in one place, so that tests can run them in virtual time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol

from nxtdrive.transports.base import WallClock

CLOSING_S = 2.0
"""How long closing waits for the link's thread, which may be reopening the link."""
_CLOCK = WallClock()


class Lock(AbstractContextManager[object], Protocol):
    """A lock, reentrant or not."""

    def acquire(self, blocking: bool = ...) -> bool:
        """Acquire it, without `blocking` only if it is free; returns whether it was acquired."""
        ...

    def release(self) -> None:
        """Release it.

        Raises:
            RuntimeError: This thread does not hold it.
        """
        ...


class Threads:
    """Threads of the operating system, on the wall clock."""

    def now(self) -> float:
        """Return the time on the clock of `wait`, in seconds."""
        return _CLOCK.now()

    def start(self, target: Callable[[], None], name: str) -> threading.Thread:
        """Start a daemon thread."""
        thread = threading.Thread(target=target, name=name, daemon=True)
        thread.start()
        return thread

    def join(self, thread: threading.Thread, timeout_s: float) -> None:
        """Wait until a thread has ended, at most `timeout_s`."""
        thread.join(timeout_s)

    def wait(self, event: threading.Event, timeout_s: float | None = None) -> bool:
        """Wait for an event, at most `timeout_s`, None: without limit; returns whether it is set."""
        return event.wait(timeout_s)

    def new_lock(self, *, reentrant: bool = False) -> Lock:
        """Make a lock that may be held during a request."""
        return threading.RLock() if reentrant else threading.Lock()


THREADS = Threads()
