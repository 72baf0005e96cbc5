"""What the radio sends to the firmware outside of stream mode. Source: docs/firmware.md section 10."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.limits import BLUETOOTH

RING = 128
"""Size of the ring buffer of what the radio sends."""

_PLACE_AFTER_BOOT, PLACE_WITH_RADIO_OFF = 62, 51
"""Place of the radio's next byte after a boot, which its answers to the firmware determine."""

STARTS_AGAIN_MS = 4950
"""From the first answer of a start, if it is not recognised, to that of the next start."""

UNENDING_MS = 1_000_000_000
"""Duration of an operation that never ends."""


class RadioLine:
    """Bytes that wait in the radio's ring buffer; outside of stream mode they are messages, one in a pass.

    Attributes:
        waiting: The bytes that are not read yet.
        taken: Those that are, of an incomplete message or telegram.
        place: Bytes that the radio has sent since the boot: where its next one is stored, modulo `RING`.
        streaming: Whether the radio is in stream mode.
        is_blocked: Whether nothing is read any more, after a message whose length is 0.
        sent_ms: When other bytes than the radio's answers came last.
    """

    def __init__(self, hear: Callable[[int, bytes], None]) -> None:
        """Make the line.

        Args:
            hear: Called with the pass and each message that was read then.
        """
        self.place, self._hear = _PLACE_AFTER_BOOT, hear
        self.waiting = self.taken = b""
        self.streaming = self.is_blocked = False
        self._message_rest, self._read_ms, self.sent_ms = 0, -1, -1

    def is_obstructed(self, at_ms: int) -> bool:
        """Return whether bytes of other messages come before an answer of that time."""
        is_other = bool(self.waiting or self._message_rest) or self.is_blocked or at_ms <= self._read_ms
        return is_other and not self.streaming

    def append(self, at_ms: int, answer: bytes) -> None:
        """Bring an answer after these bytes, which are then read if no others wait."""
        is_alone, at_ms = not self.waiting, max(at_ms, self._read_ms + 1)
        self.waiting += answer
        while is_alone and self.waiting and not self.is_blocked:
            self.take(at_ms)
            at_ms += 1

    def clear(self, before_ms: int) -> None:
        """Drop all bytes of incomplete messages that came before a time."""
        if self.sent_ms < before_ms:
            self.waiting = b""
            self.drop()

    def drop(self) -> None:
        """Drop an incomplete message."""
        self.taken, self._message_rest, self.is_blocked = b"", 0, False

    def take(self, at_ms: int) -> None:
        """Read a message, or a piece of one, in the pass at a time; the firmware clears the number in it.

        Nothing is read after a message whose length is 0, in stream mode as long as a command waits for its answer.
        """
        if self.is_blocked or not self.waiting:
            return
        if not self._message_rest:
            self.taken, self._message_rest, self.is_blocked = b"", self.waiting[0] + 1, not self.waiting[0]
        piece = self.read(min(self._message_rest, BLUETOOTH.buffer - len(self.taken)))
        self._message_rest -= len(piece)
        self._read_ms = at_ms
        if not (self.is_blocked or (self._message_rest and len(self.taken) < BLUETOOTH.buffer)):
            self._hear(at_ms, self.taken)
            self.taken = b""

    def read(self, count: int) -> bytes:
        """Take that many of the bytes that wait, but at most those up to the end of the ring, and return them."""
        count = min(count, RING - self.place % RING)
        piece, self.waiting = self.waiting[:count], self.waiting[count:]
        self.taken += piece
        self.place += len(piece)
        return piece
