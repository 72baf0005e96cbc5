"""Interfaces of every way to connect to the simulated brick: a door, and a client for each connected program.

Nothing here blocks: the server polls doors and clients in turn, and waits for all of them together.
"""

from __future__ import annotations

import contextlib
import selectors
from collections.abc import Iterable
from typing import Protocol

from firmware_protocol.errors import RemoteProtocolError
from firmware_protocol.framing import FrameReader

PARTIAL_LIMIT_S = 0.5
"""Timeout of an incomplete telegram: its program died, and bytes of the next one must not complete it."""

LOOPBACK = "127.0.0.1"
"""Default host: only programs on this computer can connect."""

SEND_BUFFER = 1 << 16
"""Size of the kernel's send buffer per connection. The kernel's own choice is megabytes: a slow camera client would see
stale frames, and a program that does not read would not be noticed."""

CHUNK = 4096
"""Bytes read from a program at a time, which bounds the number of waiting telegrams."""


ACCEPT_AGAIN_S = 0.1
"""Pause after a connection that could not be accepted; until then the listener stays readable."""

# epoll takes a file descriptor of its own, and there may be none left; Windows has no poll
_Selector = getattr(selectors, "PollSelector", selectors.SelectSelector)


class Client(Protocol):
    """One connected program.

    Attributes:
        name: Display name.
        at_end: Whether no more telegrams can arrive; replies can still be sent.
        closed: Whether the connection is closed.
    """

    name: str
    at_end: bool
    closed: bool

    def receive(self) -> list[bytes]:
        """Return the telegrams that arrived since the last call."""

    def send(self, data: bytes) -> None:
        """Send the brick's output: a packet over USB, or a piece of the stream over Bluetooth."""

    def disconnect(self) -> None:
        """Close the connection, as a pulled cable does."""

    def fileno(self) -> int:
        """Return the file descriptor to wait on for telegrams."""


class Door(Protocol):
    """A place where programs connect.

    Attributes:
        address: Address for people and programs.
        bluetooth: Whether the brick treats its telegrams as Bluetooth; otherwise as USB.
    """

    address: str
    bluetooth: bool

    def accept(self) -> list[Client]:
        """Return the programs that connected since the last call."""

    def fileno(self) -> int | None:
        """Return the file descriptor to wait on for programs; None while none can connect."""

    def close(self) -> None:
        """Close the door and release its address; may be called again."""


def completed(frames: FrameReader, data: bytes) -> list[bytes]:
    """Return the telegrams that `data` completes; invalid data is dropped, as a brick does."""
    frames.feed(data)
    telegrams = []
    with contextlib.suppress(RemoteProtocolError):  # the reader has dropped the invalid data
        while (telegram := frames.next()) is not None:
            telegrams.append(telegram)
    return telegrams


def wait_readable(files: Iterable[int], wait_s: float) -> bool:
    """Wait until one of the files is readable, for `wait_s` seconds at most; returns whether one is."""
    with _Selector() as selector:
        for file in files:
            selector.register(file, selectors.EVENT_READ)
        return bool(selector.select(max(0.0, wait_s)))
