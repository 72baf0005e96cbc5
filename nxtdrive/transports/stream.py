"""Telegrams over a stream of bytes: what Bluetooth, serial ports and TCP have in common.

Each telegram is preceded by its length, two bytes, little-endian (docs/firmware.md section 2).
"""

from __future__ import annotations

from abc import abstractmethod

from firmware_protocol.errors import LinkLost
from firmware_protocol.framing import FrameReader, frame
from nxtdrive.transports.base import WallClock

SEND_TIMEOUT_S = 1.0
"""Longest a telegram may take to leave; the brick's radio stays away no longer unless the link is gone."""


class StreamTransport(WallClock):
    """Framing and bookkeeping; a subclass reads, writes and closes its device."""

    max_telegram = 128

    def __init__(self, address: str) -> None:
        self.address = address
        self._frames = FrameReader()
        self._open = True

    def send(self, telegram: bytes) -> None:
        """Write the telegram with its length in front, in one piece."""
        self._check_open()
        self._write(frame(telegram))

    def receive(self, timeout_s: float) -> bytes | None:
        """The next telegram; the beginning of one is kept for the next call."""
        self._check_open()
        deadline = self.now() + timeout_s
        while (telegram := self._frames.next()) is None:
            data = self._read(max(0.0, deadline - self.now()))
            if data:
                self._frames.feed(data)
            elif self.now() >= deadline:
                return None
        return telegram

    def close(self) -> None:
        """Close the device once."""
        if self._open:
            self._open = False
            self._close()

    def _check_open(self) -> None:
        if not self._open:
            raise LinkLost(f"{self.address} is closed.", remedy="Open the brick again.")

    @abstractmethod
    def _read(self, timeout_s: float) -> bytes:
        """What has arrived, at least one byte, or nothing after `timeout_s`; raises LinkLost at the end of the stream."""

    @abstractmethod
    def _write(self, data: bytes) -> None:
        """All of `data`, within `SEND_TIMEOUT_S`."""

    @abstractmethod
    def _close(self) -> None:
        """Give the device back; must not raise."""
