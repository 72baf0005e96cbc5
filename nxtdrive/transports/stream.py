"""Telegrams over a byte stream: common code of Bluetooth, serial ports and TCP.

Each telegram is preceded by its length, two bytes, little-endian (docs/firmware.md section 2).
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from firmware_protocol.errors import RemoteProtocolError
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, FrameReader, frame
from nxtdrive.transports.base import WallClock, closed

SEND_TIMEOUT_S = 1.0
"""Longest time to send a telegram; a longer silence of the brick's radio means that the link is lost."""

OVERDUE_S = 0.5
"""An incomplete telegram older than this is dropped. Radio links pause for about 30 ms, and the bytes of one telegram
travel together."""
SILENCE_S = 0.1
DRAIN_S = 1.0
"""After invalid data: wait for a silence of this length, but no longer than that."""


class StreamTransport(WallClock, ABC):
    """Framing and state; a subclass reads, writes and closes its device."""

    max_telegram = BLUETOOTH_TELEGRAM_LIMIT

    def __init__(self, address: str) -> None:
        self.address = address
        self._frames = FrameReader()
        self._heard_at = 0.0
        self._open = True

    def send(self, telegram: bytes) -> None:
        """Write the telegram, preceded by its length, in one piece."""
        self._check_open()
        self._write(frame(telegram))

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next telegram or None; the beginning of one is kept for the next call unless its rest is overdue.

        Raises:
            LinkError: The link is closed or lost.
            RemoteProtocolError: The data is not a sequence of telegrams; all of it has been dropped.
        """
        self._check_open()
        deadline = self.now() + timeout_s
        try:
            while (telegram := self._frames.next()) is None:
                data = self._read(max(0.0, deadline - self.now()))
                if data:
                    self._frames.feed(data)
                    self._heard_at = self.now()
                elif self.now() >= deadline:
                    self._drop_overdue()
                    return None
        except RemoteProtocolError:
            self._drain()
            raise
        return telegram

    def waiting(self) -> bool:
        """Read what has arrived, and return whether there is anything."""
        self._check_open()
        if data := self._read_arrived():
            self._frames.feed(data)
            self._heard_at = self.now()
        return self._frames.incomplete > 0

    def _drop_overdue(self) -> None:
        """Drop an incomplete telegram: otherwise the next one would be read as its rest."""
        if self.now() - self._heard_at >= OVERDUE_S:
            self._frames.reset()

    def _drain(self) -> None:
        """Read until the peer is silent: only after a silence is the next byte the start of a telegram."""
        deadline = self.now() + DRAIN_S
        while self.now() < deadline and self._read(SILENCE_S):
            pass

    def close(self) -> None:
        """Close the device once."""
        if self._open:
            self._open = False
            self._close()

    def _check_open(self) -> None:
        if not self._open:
            raise closed(self.address)

    @abstractmethod
    def _read(self, timeout_s: float) -> bytes:
        """Return at least one byte, or none after `timeout_s`; raise LinkLost at the end of the stream."""

    def _read_arrived(self) -> bytes:
        """Return the bytes that have arrived, without waiting."""
        return self._read(0.0)

    @abstractmethod
    def _write(self, data: bytes) -> None:
        """Write all of `data` within `SEND_TIMEOUT_S`."""

    @abstractmethod
    def _close(self) -> None:
        """Release the device; must not raise."""
