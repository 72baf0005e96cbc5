"""Framing: the boundaries of telegrams. Source of all numbers: docs/firmware.md section 2.

Over USB one packet is one telegram. Over Bluetooth, and every other stream of bytes, two bytes of length, little-endian
and not counting themselves, precede each telegram in both directions.
"""

from __future__ import annotations

from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError

USB_TELEGRAM_LIMIT = 64
"""Most bytes of a telegram over USB: one packet, and the size of the brick's buffers."""

BLUETOOTH_TELEGRAM_LIMIT = 128
"""Most bytes of a telegram that the brick buffers over Bluetooth, without the length prefix."""

LENGTH_LIMIT = 0xFFFF
"""Largest value of the length prefix; only Write requests and Read replies ever exceed the brick's buffer."""

LENGTH_SIZE = 2
"""Size of the length prefix, bytes."""


def usb_packets(data: bytes) -> list[bytes]:
    """Split `data`, written at once over USB, into packets; the firmware treats each as a telegram."""
    return [data[start : start + USB_TELEGRAM_LIMIT] for start in range(0, len(data), USB_TELEGRAM_LIMIT)]


def frame(telegram: bytes) -> bytes:
    """Return the telegram with its length prefix, as sent over a byte stream.

    Raises:
        LocalProtocolError: The telegram is empty or too long.
    """
    if not 0 < len(telegram) <= LENGTH_LIMIT:
        raise LocalProtocolError(f"a telegram over Bluetooth has 1 to {LENGTH_LIMIT} bytes, not {len(telegram)}.")
    return len(telegram).to_bytes(LENGTH_SIZE, "little") + telegram


class FrameReader:
    """Extracts telegrams from a stream that arrives in chunks of any size.

    After a wrong length the stream is out of sync, so an impossible length is refused at once. To recover, read until
    the peer is silent, `reset`, and continue: only the peer's silence marks the beginning of a telegram. The same holds
    when a telegram stays `incomplete` although the peer has been silent for long (the firmware itself truncates replies
    to reads beyond the end of a file, docs/firmware.md section 2).
    """

    def __init__(self, limit: int = BLUETOOTH_TELEGRAM_LIMIT) -> None:
        """Make a reader.

        Args:
            limit: Longest telegram to expect, bytes.
        """
        self._limit = limit
        self._buffer = bytearray()

    @property
    def incomplete(self) -> int:
        """Number of bytes that wait for the rest of their telegram."""
        return len(self._buffer)

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._buffer += data

    def next(self) -> bytes | None:
        """Return the next whole telegram, or None until more bytes have arrived.

        Raises:
            RemoteProtocolError: The length prefix is zero or beyond the limit; all received bytes are dropped.
        """
        buffer = self._buffer
        if len(buffer) < LENGTH_SIZE:
            return None
        size = buffer[0] | buffer[1] << 8
        if not 0 < size <= self._limit:
            received = bytes(buffer)
            self.reset()
            raise RemoteProtocolError(
                f"a telegram of {size} bytes was announced, 1 to {self._limit} can be",
                received,
                remedy="Connect again if this repeats.",
            )
        end = LENGTH_SIZE + size
        if len(buffer) < end:
            return None
        telegram = bytes(buffer[LENGTH_SIZE:end])
        del buffer[:end]
        return telegram

    def reset(self) -> None:
        """Drop all received bytes; the next byte starts a length prefix."""
        self._buffer.clear()
