"""The comm module: telegrams in, replies out. Source: docs/firmware.md sections 2 and 3.

Two quirks of the real firmware show on the wire and are kept: the receive buffer is never cleared, so a short telegram
is completed with bytes of earlier ones; and the reply to an unknown system opcode has stale bytes.
"""

from __future__ import annotations

from typing import Any

from firmware_protocol.direct import MESSAGE_LIMIT, KeepAlive, MessageRead, MessageWrite
from firmware_protocol.enhanced import SetBreakpoints, SetInterpreterState
from firmware_protocol.framing import LENGTH_LIMIT, LENGTH_SIZE, frame
from firmware_protocol.status import Status
from firmware_protocol.system import Read, Write
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Ack, Command, Kind
from sim_backend.firmware.comm.handler_result import HandlerResult, Handlers
from sim_backend.firmware.command_link import CommandLink
from sim_backend.firmware.limits import BLUETOOTH, USB, Limits
from sim_backend.firmware.versions import Version

_WRITE_SIZE = 3
"""Bytes of a Write request before its data."""

_READ_OVERHEAD = 3
"""Bytes of a Read reply between its status and its data."""

_POINTERS = 4
"""Bytes between a receive buffer and the send buffer: pointers, the first of which has the length over Bluetooth."""

_WAITING = 1
"""Place of the number of bytes that wait to be sent, in the pointers after the send buffer."""

_ERROR = 0x80
"""Bit of the status byte that marks a failure."""

_EFFECTIVE = (KeepAlive, SetBreakpoints, SetInterpreterState)
"""Direct commands that return values but also change something."""

_SPLIT = 256
"""Length of a `Write` over Bluetooth that counts as two telegrams. Source: docs/firmware.md section 1, fact 20."""


class Comm:
    """Buffers and dispatch of one link."""

    def __init__(
        self,
        handlers: Handlers,
        link: CommandLink,
        limits: Limits,
        version: Version,
        buffers: memoryview,
    ) -> None:
        """Make the link.

        Args:
            handlers: Handler of each command.
            link: The link of the current command, for the handlers.
            limits: Sizes of this link.
            version: The firmware version.
            buffers: The module's map from the receive buffer on. Both buffers are never cleared.
        """
        self._handlers = handlers
        self._link, self._limits = link, limits
        self._commands = {
            (int(kind), opcode): command
            for (kind, opcode), command in COMMANDS.items()
            if command.since in version.commands_since
        }
        size = limits.buffer
        self._outbox_at = size + _POINTERS
        self.inbox, self.outbox = buffers[:size], buffers[self._outbox_at : self._outbox_at + size]
        self._buffers = buffers

    def receive(self, telegram: bytes) -> bytes | None:
        """Handle one telegram; bytes beyond the buffer are cut off."""
        inbox, size = self.inbox, self._limits.buffer
        telegram = telegram[:size]
        inbox[: len(telegram)] = telegram
        want_reply = not inbox[0] & NO_REPLY
        kind, opcode = inbox[0] & ~NO_REPLY, inbox[1]
        if kind == Kind.REPLY and not want_reply:
            kind = Kind.DIRECT
        if telegram and (kind, opcode) == (Kind.REPLY, MessageRead.opcode):
            self._store_message(bytes(inbox))
        if not telegram or kind not in (Kind.DIRECT, Kind.SYSTEM):
            return None
        command = self._commands.get((kind, opcode))
        if command is None:
            reply = self._unknown(kind, opcode, len(telegram))
        elif not want_reply and _is_query(command):
            return None
        else:
            result = self._handle(command, telegram)
            if result.sent is not None:
                return result.sent or None
            want_reply, opcode = not inbox[0] & NO_REPLY, inbox[1]  # which IOMapWrite may have overwritten
            reply = bytes((Kind.REPLY, opcode, result.status)) + result.payload
            if result.stale:
                reply += bytes(self.outbox[len(reply) : len(reply) + result.stale])
        if want_reply:
            self.outbox[: len(reply)] = reply[:size]
            return reply
        if kind == Kind.SYSTEM:
            self._prepare(reply)
        return None

    def _prepare(self, reply: bytes) -> None:
        """Fill the send buffer for a system command without a reply: with everything but kind and opcode."""
        self.outbox[2 : len(reply)] = reply[2 : self._limits.buffer]

    def _handle(self, command: type[Command[Any]], telegram: bytes) -> HandlerResult:
        data = bytes(self.inbox)
        if command is Write:  # only Write uses the telegram's length; other commands read stale bytes beyond its end
            data = telegram if len(telegram) >= _WRITE_SIZE else self._short_write(len(telegram))
        link = self._link
        link.limits, link.inbox, link.outbox = self._limits, self._buffers, self.outbox
        link.follows_port = not self._limits.streams
        try:
            return self._handlers[command](command.decode(data))
        finally:
            link.follows_port = False

    def _short_write(self, length: int) -> bytes:
        """Return a Write without a handle: the size of its data (its length less that of the header) has 16 bits.

        The memory after the Comm map is assumed to be zero.
        """
        return bytes(self._buffers).ljust(_WRITE_SIZE + (length - _WRITE_SIZE & 0xFFFF), b"\0")

    def _store_message(self, reply: bytes) -> None:
        """Store another brick's successful reply to a MessageRead in the mailbox it names."""
        if not reply[2] & _ERROR:
            box, size = reply[REPLY_HEADER : REPLY_HEADER + 2]
            self._handlers[MessageWrite](MessageWrite(box, size, reply[REPLY_HEADER + 2 :][:MESSAGE_LIMIT]))

    def _unknown(self, kind: int, opcode: int, length: int) -> bytes:
        if kind == Kind.DIRECT:
            return bytes((Kind.REPLY, opcode, Status.UNKNOWN_OPCODE))
        stale = bytes(self.outbox[2 : length + 2])  # zeros follow the buffer
        return bytes((Kind.REPLY, opcode)) + stale.ljust(length, b"\0")


class UsbComm(Comm):
    """The USB link, which first sends the bytes of its send buffer that wait according to its map."""

    def __init__(self, handlers: Handlers, link: CommandLink, version: Version, buffers: memoryview) -> None:
        super().__init__(handlers, link, USB, version, buffers)
        self._waiting_at = self._outbox_at + USB.buffer + _WAITING

    def receive(self, telegram: bytes) -> bytes | None:
        """Handle one telegram; bytes beyond the buffer are cut off."""
        waiting = self._buffers[self._waiting_at]
        if not waiting:
            return super().receive(telegram)
        sent = bytes(self._buffers[self._outbox_at :][:waiting]).ljust(waiting, b"\0")
        self._buffers[self._waiting_at] = 0
        return sent + (super().receive(telegram) or b"")


class BluetoothComm(Comm):
    """The Bluetooth link: a stream in which each telegram is preceded by its length.

    A telegram enters the buffer in pieces of its size, without the length. After each piece the firmware clears the
    second byte, so that a telegram of one byte has the opcode 0.
    """

    def __init__(self, handlers: Handlers, link: CommandLink, version: Version, buffers: memoryview) -> None:
        super().__init__(handlers, link, BLUETOOTH, version, buffers)
        self._head, self._written = b"", 0

    def receive_framed(self, data: bytes) -> bytes:
        """Handle one telegram preceded by its length, and return the reply in the same form, or nothing.

        A long Read is answered completely.
        """
        replies = self.begin(data[LENGTH_SIZE:])
        while self.sending:
            replies += self.next_piece()
        return replies

    @property
    def sending(self) -> bool:
        """Whether the reply to a long Read is still being sent, or would be if its file were longer."""
        return self._link.long_read.sending()

    def next_piece(self) -> bytes:
        """Return the next piece of the reply to a long Read, which the firmware sends in a pass after a telegram."""
        return self._link.long_read.next_piece()

    def begin(self, telegram: bytes) -> bytes:
        """Handle one telegram, and return the framed reply; of a long Read's only the first piece, see `next_piece`.

        Only a `Write` may be longer than the buffer (but not 256 bytes long); of other telegrams, each piece is one of
        its own. A long Read that reaches the end of its file announces more bytes than it delivers.
        """
        size, replies = BLUETOOTH.buffer, b""
        while is_divided(len(telegram), telegram):
            replies += self._framed(telegram[:size])
            telegram = telegram[size:]
        if len(telegram) <= size:
            return replies + (self._framed(telegram) if telegram else b"")
        for start in range(0, len(telegram), size):
            last = start + size >= len(telegram)
            replies += self.take_piece(telegram[start : start + size], first=not start, last=last)
        return replies

    def take_piece(self, piece: bytes, *, first: bool, last: bool) -> bytes:
        """Write a piece of a `Write` that is longer than the buffer; return the framed reply to the last one."""
        self.store(piece)
        self._buffers[BLUETOOTH.buffer] = len(piece)
        if first:
            self._head, self._written, piece = piece[:_WRITE_SIZE], 0, piece[_WRITE_SIZE:]
        result = self._handle(Write, self._head + piece)
        self._written += int.from_bytes(result.payload[1:], "little")
        if not last:
            return b""
        written = (self._written & LENGTH_LIMIT).to_bytes(LENGTH_SIZE, "little")
        reply = bytes((Kind.REPLY, Write.opcode, result.status)) + self._head[2:] + written
        if self._head[0] & NO_REPLY:
            self._prepare(reply)
            return b""
        self.outbox[: len(reply)] = reply
        return frame(reply)

    def _unknown(self, kind: int, opcode: int, length: int) -> bytes:
        """Reply as over USB, except that the length of the reply follows the send buffer."""
        reply, size = super()._unknown(kind, opcode, length), BLUETOOTH.buffer
        return reply[:size] + bytes((len(reply),)) + reply[size + 1 :] if len(reply) > size else reply

    def store(self, piece: bytes) -> None:
        """Take a telegram or a piece of one into the buffer, but do not handle it: its length is not stored."""
        self.inbox[: len(piece)] = piece
        self.inbox[1] = 0

    def forget_length(self) -> None:
        """Clear the length of the last piece: the radio leaves stream mode."""
        self._buffers[BLUETOOTH.buffer] = 0

    def _framed(self, telegram: bytes) -> bytes:
        self._buffers[BLUETOOTH.buffer] = len(telegram)
        reply = self.receive(telegram)
        self.inbox[1] = 0
        if reply is None:
            return b""
        announced = len(reply)
        if announced > REPLY_HEADER + _READ_OVERHEAD and reply[1] == Read.opcode:
            announced = REPLY_HEADER + _READ_OVERHEAD + int.from_bytes(reply[4:6], "little")
        return (announced & LENGTH_LIMIT).to_bytes(LENGTH_SIZE, "little") + reply


def is_divided(size: int, telegram: bytes) -> bool:
    """Return whether the firmware handles the first piece of a telegram, as long as its buffer, as a telegram.

    Args:
        size: Length of the whole telegram in bytes.
        telegram: Its first piece, or more of it.
    """
    return size > BLUETOOTH.buffer and (size == _SPLIT or not _is_write(telegram))


def _is_write(telegram: bytes) -> bool:
    return (telegram[0] & ~NO_REPLY, telegram[1]) == (Kind.SYSTEM, Write.opcode)


def _is_query(command: type[Command[Any]]) -> bool:
    """Return whether a direct command only returns values; the firmware skips it when no reply is wanted."""
    return command.kind == Kind.DIRECT and command.reply_type is not Ack and command not in _EFFECTIVE
