"""The comm module: telegrams in, replies out. Source: docs/firmware.md section 2 and 3.

Two things of the real firmware show on the wire and are kept: the receive buffer is never cleared, so a short telegram
is completed with bytes of the ones before it; and a system opcode without a handler is answered with stale bytes.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from firmware_protocol.direct import MESSAGE_LIMIT, KeepAlive, MessageRead, MessageWrite
from firmware_protocol.framing import LENGTH_LIMIT, LENGTH_SIZE
from firmware_protocol.status import Status
from firmware_protocol.system import Read, Write
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Ack, Command, Kind
from sim_backend.firmware.handler_result import Handlers
from sim_backend.firmware.limits import BLUETOOTH, Channel, Limits

_WRITE_SIZE = 3
"""Bytes of a Write request in front of its data."""

_READ_OVERHEAD = 3
"""Bytes of a Read reply between its status and its data."""

_ERROR = 0x80
"""Bit of a status byte that says that a command failed."""

_SPLIT = 256
"""Length of a Bluetooth telegram that the firmware takes for two. Source: docs/firmware.md section 1, fact 20."""


class Comm:
    """Buffers and dispatch of one link.

    Attributes:
        handled: The commands this firmware has handlers for.
    """

    def __init__(self, handlers: Handlers, channel: Channel, limits: Limits, *, extended: bool) -> None:
        """Make the link.

        Args:
            handlers: What to do for each command.
            channel: Tells the handlers over which link they are asked.
            limits: This link's sizes.
            extended: Whether the firmware knows the commands that came with 1.28.
        """
        self._handlers = handlers
        self._channel, self._limits = channel, limits
        self._extended = extended
        self._inbox = bytearray(limits.buffer)
        self._outbox = bytearray(limits.buffer)

    @property
    def handled(self) -> Collection[type[Command[Any]]]:
        """The commands this firmware has handlers for."""
        return self._handlers.keys()

    def receive(self, telegram: bytes) -> bytes | None:
        """Handle one telegram; what does not fit the buffer is cut, but for a `Write` over Bluetooth."""
        inbox, size = self._inbox, self._limits.buffer
        if not self._limits.streams:
            telegram = telegram[:size]
        inbox[: len(telegram)] = telegram[:size]
        want_reply = not inbox[0] & NO_REPLY
        kind, opcode = inbox[0] & ~NO_REPLY, inbox[1]
        if telegram and (kind, opcode) == (Kind.REPLY, MessageRead.opcode):
            self._store_message(bytes(inbox))
        if not telegram or kind not in (Kind.DIRECT, Kind.SYSTEM):
            return None
        command = COMMANDS.get((Kind(kind), opcode))
        if command is None or command not in self._handlers or not (self._extended or command.firmware_1_05):
            reply = self._unknown(kind, opcode, len(telegram))
        elif not want_reply and _only_asks(command):
            return None
        else:
            reply = self._handle(command, telegram)
        if not want_reply:
            return None
        self._outbox[: len(reply)] = reply[:size]
        return reply

    def _handle(self, command: type[Command[Any]], telegram: bytes) -> bytes:
        data = bytes(self._inbox)
        if command is Write:  # it alone goes by the telegram's length, the others take stale bytes for missing ones
            data = telegram if len(telegram) >= _WRITE_SIZE else data[:_WRITE_SIZE]
        self._channel.limits = self._limits
        status, payload = self._handlers[command](command.decode(data))
        return bytes((Kind.REPLY, command.opcode, status)) + payload

    def _store_message(self, reply: bytes) -> None:
        """Put what another brick answered to a MessageRead into the mailbox it asked for, if it succeeded."""
        if not reply[2] & _ERROR:
            box, size = reply[REPLY_HEADER : REPLY_HEADER + 2]
            self._handlers[MessageWrite](MessageWrite(box, size, reply[REPLY_HEADER + 2 :][:MESSAGE_LIMIT]))

    def _unknown(self, kind: int, opcode: int, length: int) -> bytes:
        if kind == Kind.DIRECT:
            return bytes((Kind.REPLY, opcode, Status.UNKNOWN_OPCODE))
        return bytes((Kind.REPLY, opcode)) + self._outbox[2 : length + 2]


class BluetoothComm(Comm):
    """The link over Bluetooth: a stream in which every telegram has its length in front."""

    def __init__(self, handlers: Handlers, channel: Channel, *, extended: bool) -> None:
        super().__init__(handlers, channel, BLUETOOTH, extended=extended)

    def receive_framed(self, data: bytes) -> bytes:
        """Handle one telegram with its length in front; returns the reply in the same form, or nothing.

        A long Read that meets the end of its file announces more than it then delivers, as the firmware does.
        """
        telegram = data[LENGTH_SIZE:]
        if len(telegram) == _SPLIT:
            return self._framed(telegram[: BLUETOOTH.buffer]) + self._framed(telegram[BLUETOOTH.buffer :])
        return self._framed(telegram)

    def _framed(self, telegram: bytes) -> bytes:
        reply = self.receive(telegram)
        if reply is None:
            return b""
        announced = len(reply)
        if len(telegram) >= 2 and (telegram[0], telegram[1]) == (Kind.SYSTEM, Read.opcode):
            announced = REPLY_HEADER + _READ_OVERHEAD + int.from_bytes(reply[4:6], "little")
        return (announced & LENGTH_LIMIT).to_bytes(LENGTH_SIZE, "little") + reply


def _only_asks(command: type[Command[Any]]) -> bool:
    """Whether a direct command does nothing but answer; the firmware skips it when no reply is wanted."""
    return command.kind == Kind.DIRECT and command.reply_type is not Ack and command is not KeepAlive
