"""Bytes from the radio on their way to the firmware, as in the recordings: a ring buffer, read once in a pass."""

from __future__ import annotations

from math import inf

from firmware_protocol.framing import LENGTH_SIZE
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.comm.dispatch import is_divided
from sim_backend.firmware.limits import BLUETOOTH
from sim_backend.firmware.radio import RING

_LATER_BY_USB = 1
"""Passes by which a command to the radio over USB ends the stream later."""


class RadioStream:
    """The stream of telegrams, each preceded by its length.

    In one pass the firmware reads at most to the end of the ring, and at most one piece of a telegram that is longer
    than its buffer. When the ring was too small for bytes that were sent, and they end where it does, the next pass
    with bytes reads none.

    A command to the radio itself, as a new name, ends the stream for good. So does one that the stream's beginning has
    lost, if telegrams come while the firmware waits for its answer.

    Outside of stream mode the firmware takes the bytes for messages of the radio. It reads at most one in a pass.

    Attributes:
        waiting: The bytes that are not read yet.
    """

    def __init__(self, brick: SimBrick) -> None:
        self._brick = brick
        self.waiting = b""
        self._taken = self._partial = b""
        self._message_rest, self._read_ms, self._sent_ms = 0, -1, -1
        self._stays = self._is_stream = self._was_full = self._at_end = self._is_blocked = False
        self._end_ms: int | None = None
        self._left_ms = 0
        brick.radio.line = self

    @property
    def awaits_answers(self) -> bool:
        """Whether bytes are messages, and the radio's answers to a command are among those that come."""
        return not self.is_stream and self._brick.radio.seems_busy

    @property
    def ends(self) -> bool:
        """Whether the stream has ended, or will in the next passes."""
        return self._end_ms is not None and self.is_stream

    @property
    def sending(self) -> bool:
        """Whether a long reply is still being sent."""
        return self._brick.bluetooth.sending

    @property
    def incomplete(self) -> bool:
        """Whether the bytes sent end within a telegram."""
        return bool(self._partial)

    @property
    def is_stream(self) -> bool:
        """Whether the radio is on and in stream mode; otherwise the firmware takes bytes for its messages."""
        return self._is_stream and self._brick.radio.is_on

    def send(self, data: bytes) -> int:
        """Append bytes, and return how many pieces the telegrams have that they complete."""
        self._brick.radio.settle(self._brick.now_ms - 1)
        self.waiting, self._sent_ms = self.waiting + data, self._brick.now_ms
        if self._brick.radio.awaits_lost_answer and not self._is_blocked:
            self._end_ms = self._brick.now_ms
        else:
            self.note_command()
        complete, self._partial = _split(self._partial + data)
        self._was_full = len(self.waiting) + self._at_end > RING
        return complete

    def read_on(self) -> None:
        """Let the firmware read in a pass whose replies are not recorded."""
        if self.waiting:
            self.take()

    def switch(self, *, stream: bool) -> None:
        """Begin or end the radio's stream mode, which drops an incomplete telegram.

        A stream that has ended begins again when the command to the radio is over.
        """
        self._partial = b""
        if stream == self._is_stream:
            return
        self._is_stream = self._brick.radio.streaming = stream
        self._stays = not stream
        if not stream:
            self._left_ms = self._brick.now_ms
            self.follow()
            return
        blocked = self._is_blocked and self._brick.radio.operating
        self._drop_message()
        self._is_blocked = blocked
        if self._left_ms < self._brick.now_ms and self._brick.radio.stream_ends_ms == inf:
            self._end_ms = None

    def follow(self) -> None:
        """Leave stream mode when it is time: a command that waits for that keeps the firmware in it."""
        if self._stays and self._brick.now_ms >= self._brick.radio.leaves_ms:
            self._stays = False
            self._drop_message()
            self._brick.bluetooth.forget_length()

    def _drop_message(self) -> None:
        self._taken, self._message_rest, self._is_blocked = b"", 0, False

    def postpone(self, passes: int) -> None:
        """Delay what the radio brings: it stands still for the next passes of the firmware."""
        self._brick.radio.postpone(passes)
        self._left_ms += passes
        if self._end_ms is not None and self._end_ms <= self._brick.now_ms:
            self._end_ms += passes

    def note_command(self, later: int = _LATER_BY_USB) -> None:
        """End the stream if the radio waits for that, by so many passes later than with a command over Bluetooth."""
        ends_ms = self._brick.radio.stream_ends_ms
        if self._is_stream and self._end_ms is None and ends_ms < inf:
            self._end_ms = int(ends_ms) + later

    def take(self) -> bytes:
        """Return what the firmware sends in one pass: the reply to a telegram, and a piece of one to a long Read."""
        self.follow()
        if not (self.is_stream or self._stays):
            self._take_message(self._brick.now_ms)
            return b""
        continues = self.sending
        reply = self._take()
        return reply + self._brick.bluetooth.next_piece() if continues else reply

    def is_obstructed(self, at_ms: int) -> bool:
        """Return whether bytes of other messages come before an answer of that time."""
        is_other = bool(self.waiting or self._message_rest) or self._is_blocked or at_ms <= self._read_ms
        return is_other and not self._is_stream

    def append(self, at_ms: int, answer: bytes) -> None:
        """Bring an answer after these bytes, which are then read if no others wait."""
        is_alone, at_ms = not self.waiting, max(at_ms, self._read_ms + 1)
        self.waiting += answer
        while is_alone and self.waiting and not self._is_blocked:
            self._take_message(at_ms)
            at_ms += 1

    def clear(self, before_ms: int) -> None:
        """Drop all bytes of incomplete messages that came before a time."""
        if self._sent_ms < before_ms:
            self.waiting = b""
            self._drop_message()

    def _take_message(self, at_ms: int) -> None:
        """Read a message, or a piece of one, in the pass at a time; the firmware clears the number in it.

        Nothing is read after a message whose length is 0, in stream mode as long as a command waits for its answer.
        """
        radio = self._brick.radio
        place = radio.ring_place
        if self._is_blocked or not self.waiting:
            return
        if not self._message_rest:
            self._taken, self._message_rest, self._is_blocked = b"", self.waiting[0] + 1, not self.waiting[0]
        count = min(self._message_rest, RING - place % RING, BLUETOOTH.buffer - len(self._taken))
        piece, self.waiting = self.waiting[:count], self.waiting[count:]
        self._taken += piece
        radio.ring_place = place + len(piece)
        self._message_rest -= len(piece)
        self._read_ms = at_ms
        if not (self._is_blocked or (self._message_rest and len(self._taken) < BLUETOOTH.buffer)):
            radio.hear(at_ms, self._taken)
            self._taken = b""

    def _take(self) -> bytes:
        """Read as much as the firmware does in one pass, and return the reply to a telegram that is complete then."""
        self._is_blocked = self._is_blocked and self._brick.radio.seems_busy
        if self._is_blocked:
            return b""
        if self._at_end and self.waiting:
            self._at_end = False
            return b""
        radio = self._brick.radio
        ahead = self._taken + self.waiting[: RING - radio.ring_place % RING]
        done = max(len(self._taken) - LENGTH_SIZE, 0) // BLUETOOTH.buffer * BLUETOOTH.buffer
        end = min(_size(ahead), LENGTH_SIZE + done + BLUETOOTH.buffer)
        count = len(ahead[:end]) - len(self._taken)
        self._taken, self.waiting = ahead[:end], self.waiting[count:]
        radio.ring_place += count
        if not self.waiting:
            self._at_end = self._was_full and radio.ring_place % RING == 0
            self._was_full = False
        size = _size(self._taken)
        if len(self._taken) < min(size, LENGTH_SIZE + done + BLUETOOTH.buffer):
            return b""
        return self._handle(self._taken[LENGTH_SIZE + done :], size - LENGTH_SIZE, first=not done)

    def _handle(self, piece: bytes, size: int, *, first: bool) -> bytes:
        """Let the firmware handle a telegram, or a piece of one of `size` bytes, and return the reply."""
        bluetooth, last = self._brick.bluetooth, len(self._taken) == LENGTH_SIZE + size
        if last:
            self._taken = b""
        divided = first and is_divided(size, piece)
        if divided:
            self._taken = (size - BLUETOOTH.buffer).to_bytes(LENGTH_SIZE, "little")
        if self._end_ms is not None and self._brick.now_ms >= self._end_ms:
            bluetooth.store(piece)
            return b""
        if divided or size <= BLUETOOTH.buffer:
            reply = bluetooth.begin(piece)
        else:
            reply = bluetooth.take_piece(piece, first=first, last=last)
        self.note_command(0)
        return reply


def _split(stream: bytes) -> tuple[int, bytes]:
    """Return the number of pieces of the complete telegrams in a stream, and the beginning of an incomplete one."""
    rest, pieces = stream, 0
    while len(rest) >= (size := _size(rest)):
        rest, pieces = rest[size:], pieces + max(1, -(-(size - LENGTH_SIZE) // BLUETOOTH.buffer))
    return pieces, rest


def _size(stream: bytes) -> int:
    """Return the size of the first telegram with its length; of its length alone, if that is incomplete."""
    if len(stream) < LENGTH_SIZE:
        return LENGTH_SIZE
    return LENGTH_SIZE + int.from_bytes(stream[:LENGTH_SIZE], "little")
