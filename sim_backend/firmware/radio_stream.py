"""The stream of telegrams over Bluetooth, read once in a pass. Source: docs/firmware.md sections 2 and 10."""

from __future__ import annotations

from math import inf

from firmware_protocol.framing import LENGTH_SIZE
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.comm.dispatch import is_divided
from sim_backend.firmware.limits import BLUETOOTH
from sim_backend.firmware.radio_line import RING

_LATER_BY_USB = 1
"""Passes by which a command to the radio over USB ends the stream later."""


class RadioStream:
    """The stream of telegrams, each preceded by its length.

    In one pass the firmware reads at most to the end of the ring, and at most one piece of a telegram that is longer
    than its buffer. When the ring was too small for bytes that were sent, and they end where it does, the next pass
    with bytes reads none.

    A command to the radio itself, as a new name, ends the stream for good. So does one that the stream's beginning has
    lost, if telegrams come while the firmware waits for its answer.

    Outside of stream mode the firmware takes the bytes for messages of the radio.
    """

    def __init__(self, brick: SimBrick) -> None:
        self._brick, self._radio, self._line = brick, brick.radio, brick.radio.line
        self._partial = b""
        self._stays = self._was_full = self._at_end = False
        self._end_ms: int | None = None
        self._left_ms = 0

    @property
    def waiting(self) -> bytes:
        """The bytes that are not read yet."""
        return self._line.waiting

    @property
    def awaits_answers(self) -> bool:
        """Whether bytes are messages, and the radio's answers to a command are among those that come."""
        return not self.is_stream and self._radio.seems_busy

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
        return self._line.streaming and self._radio.is_on

    def send(self, data: bytes) -> int:
        """Append bytes, and return how many pieces the telegrams have that they complete."""
        line = self._line
        self._radio.settle(self._brick.now_ms - 1)
        line.waiting, line.sent_ms = line.waiting + data, self._brick.now_ms
        if self._radio.awaits_lost_answer and not line.is_blocked:
            self._end_ms = self._brick.now_ms
        else:
            self.note_command()
        complete, self._partial = _split(self._partial + data)
        self._was_full = len(line.waiting) + self._at_end > RING
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
        if stream == self._line.streaming:
            return
        self._radio.set_streaming(stream)
        self._stays = not stream
        if not stream:
            self._left_ms = self._brick.now_ms
            self.follow()
            return
        blocked = self._line.is_blocked and self._radio.operating
        self._line.drop()
        self._line.is_blocked = blocked
        if self._left_ms < self._brick.now_ms and self._radio.stream_ends_ms == inf:
            self._end_ms = None

    def follow(self) -> None:
        """Leave stream mode when it is time: a command that waits for that keeps the firmware in it."""
        if self._stays and self._brick.now_ms >= self._radio.leaves_ms:
            self._stays = False
            self._line.drop()
            self._brick.bluetooth.forget_length()

    def postpone(self, passes: int) -> None:
        """Delay what the radio brings: it stands still for the next passes of the firmware."""
        self._radio.postpone(passes)
        self._left_ms += passes
        if self._end_ms is not None and self._end_ms <= self._brick.now_ms:
            self._end_ms += passes

    def note_command(self, later: int = _LATER_BY_USB) -> None:
        """End the stream if the radio waits for that, by so many passes later than with a command over Bluetooth."""
        ends_ms = self._radio.stream_ends_ms
        if self._line.streaming and self._end_ms is None and ends_ms < inf:
            self._end_ms = int(ends_ms) + later

    def take(self) -> bytes:
        """Return what the firmware sends in one pass: the reply to a telegram, and a piece of one to a long Read."""
        self.follow()
        if not (self.is_stream or self._stays):
            self._radio.settle()
            self._line.take(self._brick.now_ms)
            return b""
        continues = self.sending
        reply = self._take()
        return reply + self._brick.bluetooth.next_piece() if continues else reply

    def _take(self) -> bytes:
        """Read as much as the firmware does in one pass, and return the reply to a telegram that is complete then."""
        line = self._line
        line.is_blocked = line.is_blocked and self._radio.seems_busy
        if line.is_blocked:
            return b""
        if self._at_end and line.waiting:
            self._at_end = False
            return b""
        self._radio.settle()
        done = max(len(line.taken) - LENGTH_SIZE, 0) // BLUETOOTH.buffer * BLUETOOTH.buffer
        piece_end = LENGTH_SIZE + done + BLUETOOTH.buffer
        ahead = line.taken + line.waiting[: RING - line.place % RING]
        line.read(min(_size(ahead), piece_end) - len(line.taken))
        if not line.waiting:
            self._at_end = self._was_full and line.place % RING == 0
            self._was_full = False
        size = _size(line.taken)
        if len(line.taken) < min(size, piece_end):
            return b""
        return self._handle(line.taken[LENGTH_SIZE + done :], size - LENGTH_SIZE, first=not done)

    def _handle(self, piece: bytes, size: int, *, first: bool) -> bytes:
        """Let the firmware handle a telegram, or a piece of one of `size` bytes, and return the reply."""
        line, bluetooth = self._line, self._brick.bluetooth
        last = len(line.taken) == LENGTH_SIZE + size
        if last:
            line.taken = b""
        divided = first and is_divided(size, piece)
        if divided:
            line.taken = (size - BLUETOOTH.buffer).to_bytes(LENGTH_SIZE, "little")
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
