"""Where one telegram ends and the next begins. Source of all numbers: docs/firmware.md section 2.

Over USB one packet is one telegram. Over Bluetooth, and every other stream of bytes, two bytes of length, little-endian
and not counting themselves, precede each telegram in both directions.
"""

from __future__ import annotations

from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError

USB_TELEGRAM_LIMIT = 64
"""Most bytes of a telegram over USB: one packet, and the size of the brick's buffers."""

BLUETOOTH_TELEGRAM_LIMIT = 128
"""Most bytes of a telegram that the brick buffers over Bluetooth, the length in front not counted."""

LENGTH_LIMIT = 0xFFFF
"""Most bytes a length can announce; only Write requests and Read replies ever exceed the brick's buffer."""

LENGTH_SIZE = 2
"""Bytes of length in front of a telegram."""


def usb_packets(data: bytes) -> list[bytes]:
    """What the brick sees of `data` written at once over USB: packets, each of them a telegram to the firmware."""
    return [data[start : start + USB_TELEGRAM_LIMIT] for start in range(0, len(data), USB_TELEGRAM_LIMIT)]


def frame(telegram: bytes) -> bytes:
    """The telegram with its length in front, as it goes over a stream.

    Raises:
        LocalProtocolError: It is empty or longer than a length can say.
    """
    if not 0 < len(telegram) <= LENGTH_LIMIT:
        raise LocalProtocolError(f"a telegram over Bluetooth has 1 to {LENGTH_LIMIT} bytes, not {len(telegram)}.")
    return len(telegram).to_bytes(LENGTH_SIZE, "little") + telegram


class FrameReader:
    """Telegrams out of a stream that arrives in pieces of any size.

    A wrong length is the end of all order in a stream, so one that cannot be true is refused at once instead of waited
    for. What to do then: read until the peer is silent, `reset`, and go on; nothing but a peer's silence marks a
    telegram's beginning. The same holds when a telegram stays `incomplete` although the peer has been silent for long
    (the firmware itself does that to reads beyond the end of a file, docs/firmware.md section 2).
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
        """Bytes that wait for the rest of their telegram."""
        return len(self._buffer)

    def feed(self, data: bytes) -> None:
        """Take in what has arrived."""
        self._buffer += data

    def next(self) -> bytes | None:
        """The next whole telegram, or None until more has arrived.

        Raises:
            RemoteProtocolError: The length in front is zero or beyond the limit; all that was taken in is dropped.
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
        """Drop what was taken in; the next byte is the first of a length."""
        self._buffer.clear()
