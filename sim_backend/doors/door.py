"""What every way to plug into the simulated brick offers: a door, and a client for each program that has come in.

Nothing here ever blocks: a door and its clients are looked at in turns, and wait only together with all others.
"""

from __future__ import annotations

import contextlib
from typing import Protocol

from firmware_protocol.errors import RemoteProtocolError
from firmware_protocol.framing import FrameReader

PARTIAL_LIMIT_S = 0.5
"""A telegram whose rest has not come by then belongs to a program that died; the next one's must not complete it."""

LOOPBACK = "127.0.0.1"
"""Default host: only programs on this computer can connect."""

SEND_BUFFER = 1 << 16
"""Size of the kernel's send buffer per connection. The kernel's own choice is megabytes: a slow camera client would see
stale frames, and a program that does not read would not be noticed."""

CHUNK = 4096
"""Bytes taken from a program at a time, which bounds the telegrams it can have waiting."""


class Client(Protocol):
    """One program at a door.

    Attributes:
        name: Who it is, for people.
        at_end: Whether nothing more can come from it; what it has asked for can still be handed to it.
        closed: Whether it is gone.
    """

    name: str
    at_end: bool
    closed: bool

    def receive(self) -> list[bytes]:
        """The telegrams that have arrived since the last call."""

    def send(self, data: bytes) -> None:
        """Hand over what the brick sends: a packet over USB, a piece of the stream over Bluetooth."""

    def hang_up(self) -> None:
        """End the connection, as a pulled cable does."""

    def fileno(self) -> int:
        """What to wait on for telegrams."""


class Door(Protocol):
    """Where programs plug in.

    Attributes:
        address: Where it is, for people and programs.
        bluetooth: Whether the brick takes what comes through it for Bluetooth; else for USB.
    """

    address: str
    bluetooth: bool

    def arrivals(self) -> list[Client]:
        """The programs that have come in since the last call."""

    def fileno(self) -> int | None:
        """What to wait on for programs; None while nobody can come in."""

    def close(self) -> None:
        """Send everybody away and take the address back; may be called again."""


def completed(frames: FrameReader, data: bytes) -> list[bytes]:
    """The telegrams that `data` completes; what is no telegram is dropped, as a brick does."""
    frames.feed(data)
    telegrams = []
    with contextlib.suppress(RemoteProtocolError):  # the reader has dropped it
        while (telegram := frames.next()) is not None:
            telegrams.append(telegram)
    return telegrams
