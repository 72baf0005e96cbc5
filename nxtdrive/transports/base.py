"""What every way to a brick offers: five methods, one of them the clock.

The clock belongs to the transport because only the transport knows what time means: over a cable it is the wall clock,
in the simulator it is the number of simulated milliseconds. Nothing above this folder reads a clock of its own.
"""

from __future__ import annotations

import time
from typing import Protocol


class Transport(Protocol):
    """A way to one brick.

    A transport moves whole telegrams and knows nothing of what they mean. It is used by one thread at a time; `Brick`
    holds the lock.

    Attributes:
        address: How to open this very link again, e.g. ``usb://0016530A1B2C``.
        max_telegram: Longest telegram the brick's buffers take on this link, bytes (docs/firmware.md section 2).
        simulated: Whether time passes only while somebody sleeps or receives; then no thread of ours may run beside it.
    """

    address: str
    max_telegram: int
    simulated: bool

    def send(self, telegram: bytes) -> None:
        """Hand one telegram to the brick; returns within a second or raises.

        Raises:
            LinkError: The link is closed, lost or does not take the telegram.
        """
        ...

    def receive(self, timeout_s: float) -> bytes | None:
        """The next whole telegram, or None when `timeout_s` has passed without one.

        Part of a telegram is kept for the next call. A timeout is no error here: only the dialogue knows whether an
        answer was due.

        Raises:
            LinkError: The link is closed or lost.
        """
        ...

    def close(self) -> None:
        """Give the device back; may be called again."""
        ...

    def now(self) -> float:
        """Seconds since an arbitrary start; never goes back."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Let `duration_s` pass; zero and less return at once."""
        ...


class WallClock:
    """The clock of transports that lead to real hardware."""

    simulated = False

    def now(self) -> float:
        """Seconds of the monotonic clock."""
        return time.monotonic()

    def sleep(self, duration_s: float) -> None:
        """Let the thread rest."""
        if duration_s > 0:
            time.sleep(duration_s)
