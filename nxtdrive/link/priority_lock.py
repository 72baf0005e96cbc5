"""Whose turn it is on a wire that only one thread can use at a time.

A plain lock hands itself to whoever comes first after it is free, which is often the thread that has just had it. Here
those who wait are served in order, and what is urgent before what is not, so that stopping a motor never waits for more
than the one question that is being answered.

Who uses it looks, takes the lock, and leaves::

    try:
        if turns.queue or turns.wire.locked():
            turns.wait(urgent, timeout_s)
        with turns.wire:
            ...
    finally:
        if turns.queue:
            turns.leave()

Nothing of this but the lock costs anything while nobody waits. Who needs the wire only for a moment and cannot wait,
such as the heartbeat, takes it with `PriorityLock.aside`; taking the bare lock would leave those uncalled who queued up
meanwhile.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count

from firmware_protocol.direct import ResetMotorPosition, SetOutputState, UpdateResetCount
from firmware_protocol.errors import LinkTimeout
from firmware_protocol.system import IOMapWrite

PREEMPTING = (SetOutputState, IOMapWrite, ResetMotorPosition, UpdateResetCount)
"""Commands that drive motors; they overtake others that wait for the wire."""


@dataclass(slots=True, order=True)
class _Place:
    """A thread's place in the queue; the smallest is next."""

    patient: bool
    number: int
    thread: int = field(compare=False)
    called: threading.Event = field(compare=False, default_factory=threading.Event)


class PriorityLock:
    """The queue in front of a wire.

    Attributes:
        wire: Held while the wire is in use.
        queue: Who waits, and who of them is being served; empty while the wire has one user.
    """

    def __init__(self) -> None:
        self.wire = threading.Lock()
        self.queue: list[_Place] = []
        self._door = threading.Lock()
        self._numbers = count()

    def wait(self, urgent: bool, timeout_s: float) -> None:
        """Queue up until it is this thread's turn; `leave` afterwards in any case.

        Raises:
            LinkTimeout: Others held the wire all the time.
        """
        place = _Place(not urgent, next(self._numbers), threading.get_ident())
        with self._door:
            self.queue.append(place)
            if not self.wire.locked() and min(self.queue) is place:
                return
        if not place.called.wait(timeout_s):
            raise LinkTimeout(
                f"other threads of this program kept the link busy for {timeout_s:g} s.",
                remedy="Ask less often, or allow more time.",
            )

    def leave(self) -> None:
        """Give up this thread's place and call the next one."""
        me = threading.get_ident()
        with self._door:
            self.queue[:] = [place for place in self.queue if place.thread != me]
            self._call()

    @contextmanager
    def aside(self) -> Iterator[None]:
        """The wire for a moment, without a place in the queue."""
        try:
            with self.wire:
                yield
        finally:
            if self.queue:
                with self._door:
                    self._call()

    def _call(self) -> None:
        """Call the next one, or again the one who is being served; the caller holds the door."""
        if self.queue:
            min(self.queue).called.set()
