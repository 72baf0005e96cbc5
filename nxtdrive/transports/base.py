"""The interface of all transports: six methods, two of them the clock.

The clock belongs to the transport because it defines time: over a cable that is the wall clock,
in the simulator the number of simulated milliseconds. Code above this package reads no other clock.
"""

from __future__ import annotations

import time
from typing import Protocol

from firmware_protocol.errors import LinkLost, RemoteProtocolError

SURPLUS_LIMIT = 64
"""Maximum number of telegrams discarded at once; a peer that sends more never stops."""


class Transport(Protocol):
    """A link to one brick.

    A transport carries whole telegrams and does not interpret them. It is used by one thread at a time; `Brick` holds
    the lock.

    Attributes:
        address: Opens a link to the same brick again, e.g. ``usb://0016530A1B2C``.
        max_telegram: Longest telegram that fits the brick's buffers on this link, bytes (docs/firmware.md section 2).
        simulated: Whether time passes only in `sleep` and `receive`; then no thread of the driver may run beside it.
    """

    address: str
    max_telegram: int
    simulated: bool

    def send(self, telegram: bytes) -> None:
        """Send one telegram; return within a second or raise.

        Raises:
            LinkError: The link is closed, lost or does not take the telegram.
        """
        ...

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next whole telegram, or None after `timeout_s` without one.

        Part of a telegram is kept for the next call. A timeout is not an error here: only the dialogue can tell whether
        a reply was expected.

        Raises:
            LinkError: The link is closed or lost.
        """
        ...

    def waiting(self) -> bool:
        """Return whether bytes have arrived that `receive` has not returned; does not wait.

        Telegrams that wait before a request is sent are surplus. A transport that cannot check returns False.

        Raises:
            LinkError: The link is closed or lost.
        """
        ...

    def close(self) -> None:
        """Release the device; may be called again."""
        ...

    def now(self) -> float:
        """Return seconds since an arbitrary start; monotonic."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Let `duration_s` pass; return at once if it is not positive."""
        ...


def closed(address: str) -> LinkLost:
    """Make the error of a transport that is used after it was closed."""
    return LinkLost(f"{address} is closed.", remedy="Open the brick again.")


def drain(transport: Transport) -> int:
    """Discard what has arrived, and return the number of telegrams; data that is not telegrams counts as one.

    Raises:
        LinkError: The link is closed or lost.
    """
    discarded = 0
    try:
        while discarded < SURPLUS_LIMIT and transport.receive(0.0) is not None:
            discarded += 1
    except RemoteProtocolError:  # the transport has dropped the rest
        discarded += 1
    return discarded


class WallClock:
    """The clock of transports that lead to real hardware."""

    simulated = False

    def now(self) -> float:
        """Return seconds of the monotonic clock."""
        return time.monotonic()

    def sleep(self, duration_s: float) -> None:
        """Suspend the thread for `duration_s`."""
        if duration_s > 0:
            time.sleep(duration_s)
