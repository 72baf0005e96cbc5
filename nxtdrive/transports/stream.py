"""Telegrams over a stream of bytes: what Bluetooth, serial ports and TCP have in common.

Each telegram is preceded by its length, two bytes, little-endian (docs/firmware.md section 2).
"""

from __future__ import annotations

from abc import abstractmethod

from firmware_protocol.errors import LinkLost, RemoteProtocolError
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, FrameReader, frame
from nxtdrive.transports.base import WallClock

SEND_TIMEOUT_S = 1.0
"""Longest a telegram may take to leave; the brick's radio stays away no longer unless the link is gone."""

OVERDUE_S = 0.5
"""When the rest of a telegram has not come for so long, it will not come. Radio links falter for some 30 ms, and bytes
of one telegram travel together."""
SILENCE_S = 0.1
DRAIN_S = 1.0
"""After nonsense: wait for a silence, but not for ever."""


class StreamTransport(WallClock):
    """Framing and bookkeeping; a subclass reads, writes and closes its device."""

    max_telegram = BLUETOOTH_TELEGRAM_LIMIT

    def __init__(self, address: str) -> None:
        self.address = address
        self._frames = FrameReader()
        self._heard_at = 0.0
        self._open = True

    def send(self, telegram: bytes) -> None:
        """Write the telegram with its length in front, in one piece."""
        self._check_open()
        self._write(frame(telegram))

    def receive(self, timeout_s: float) -> bytes | None:
        """The next telegram; the beginning of one is kept for the next call, unless its rest is long overdue.

        Raises:
            LinkError: The link is closed or lost.
            RemoteProtocolError: What arrived cannot be telegrams; all of it has been dropped.
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

    def _drop_overdue(self) -> None:
        """Half a telegram whose rest does not come would swallow the beginning of the next one."""
        if self._frames.incomplete and self.now() - self._heard_at >= OVERDUE_S:
            self._frames.reset()

    def _drain(self) -> None:
        """Read until the peer is silent: only a silence shows where a telegram begins."""
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
            raise LinkLost(f"{self.address} is closed.", remedy="Open the brick again.")

    @abstractmethod
    def _read(self, timeout_s: float) -> bytes:
        """What has arrived, at least one byte, or nothing after `timeout_s`; LinkLost at the end of the stream."""

    @abstractmethod
    def _write(self, data: bytes) -> None:
        """All of `data`, within `SEND_TIMEOUT_S`."""

    @abstractmethod
    def _close(self) -> None:
        """Give the device back; must not raise."""
