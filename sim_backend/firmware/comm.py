"""The comm module: telegrams in, replies out. Source: docs/firmware.md section 2 and 3.

Two things of the real firmware show on the wire and are kept: the receive buffer is never cleared, so a short telegram
is completed with bytes of the ones before it; and a system opcode without a handler is answered with stale bytes.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from firmware_protocol.status import Status
from firmware_protocol.system import Write
from firmware_protocol.telegram import COMMANDS, NO_REPLY, Command, Kind
from sim_backend.firmware.answer import Handlers

PACKET = 64
"""Bytes of a USB packet and of the firmware's USB buffers."""

_WRITE_SIZE = 3
"""Bytes of a Write request in front of its data."""


class Comm:
    """Buffers and dispatch of one link.

    Attributes:
        length: Bytes of the telegram being handled; what lies beyond in the buffer is stale.
        want_reply: Whether the telegram being handled asks for a reply.
    """

    def __init__(self, handlers: Handlers, *, extended: bool) -> None:
        """Make the module.

        Args:
            handlers: What to do for each command.
            extended: Whether the firmware knows the commands that came with 1.28.
        """
        self._handlers = handlers
        self._extended = extended
        self._inbox = bytearray(PACKET)
        self._outbox = bytearray(PACKET)
        self.length = 0
        self.want_reply = True

    def receive(self, telegram: bytes) -> bytes | None:
        """Handle one telegram of at most 64 bytes (more is cut, as no packet carries it)."""
        telegram = telegram[:PACKET]
        inbox = self._inbox
        inbox[: len(telegram)] = telegram
        self.length = len(telegram)
        self.want_reply = not inbox[0] & NO_REPLY
        kind, opcode = inbox[0] & ~NO_REPLY, inbox[1]
        if not telegram or kind not in (Kind.DIRECT, Kind.SYSTEM):
            return None
        command = COMMANDS.get((Kind(kind), opcode))
        handler = self._handlers.get(command) if command and self._knows(command) else None
        if handler is None or command is None:
            return self._unknown(kind, opcode)
        # Write alone goes by the telegram's length, all others by their own fields and what is stale behind them
        size = max(self.length, _WRITE_SIZE) if command is Write else PACKET
        status, payload = handler(command.decode(bytes(inbox[:size])))
        return self._reply(bytes((Kind.REPLY, opcode, status)) + payload)

    @property
    def handled(self) -> Collection[type[Command[Any]]]:
        """The commands this firmware has handlers for."""
        return self._handlers.keys()

    def stale(self, start: int, stop: int) -> bytes:
        """Bytes left in the reply buffer by earlier replies."""
        return bytes(self._outbox[start:stop])

    def _knows(self, command: type[Command[Any]]) -> bool:
        return self._extended or command.firmware_1_05

    def _unknown(self, kind: int, opcode: int) -> bytes | None:
        if kind == Kind.DIRECT:
            return self._reply(bytes((Kind.REPLY, opcode, Status.UNKNOWN_OPCODE)))
        size = min(self.length + 2, PACKET)
        return self._reply(bytes((Kind.REPLY, opcode)) + self.stale(2, size))

    def _reply(self, reply: bytes) -> bytes | None:
        if not self.want_reply:
            return None
        self._outbox[: len(reply)] = reply
        return reply
