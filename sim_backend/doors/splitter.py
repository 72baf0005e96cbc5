"""Telegrams out of a stream that does not say where they end.

nxt-python's server protocol sends telegrams as they are, so that a burst arrives as one piece. What each begins with
says how long it is, for all commands but a few; those end where the stream pauses.
"""

from __future__ import annotations

from typing import Any

from firmware_protocol.direct import LSWrite, MessageWrite, SetProperty
from firmware_protocol.enums import Property
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.system import IOMapWrite
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REQUEST_HEADER, Command, Kind

GET_LINK_TYPE, CLOSE = 0x98, 0x99
"""Telegrams of one byte for the server itself: which link the brick is on, and good bye."""

END_S = 0.002
"""A telegram that does not tell its length ends with such a pause: two passes of the brick. What a program sends at
once arrives at once, up to far more than a telegram."""

SHORT_S = 0.5
"""When the rest of a telegram has not come by then, it was a short one; the brick takes those as well."""

_DATA_LENGTH: dict[type[Command[Any]], str] = {
    MessageWrite: "size",
    LSWrite: "tx_length",
    IOMapWrite: "size",
}
"""Commands with data at the end, and their field that tells how much."""


class TelegramSplitter:
    """Takes in bytes, gives out telegrams of at most a USB packet."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> None:
        """Take in what has arrived."""
        self._buffer += data

    def next(self, silent_s: float) -> bytes | None:
        """The next telegram, or None until more has arrived or the silence has lasted.

        Args:
            silent_s: For how long nothing has arrived.
        """
        buffer = self._buffer
        if not buffer:
            return None
        size = announced_size(buffer)
        if size is None:
            end = len(buffer) if silent_s >= END_S else USB_TELEGRAM_LIMIT
        else:
            end = size if silent_s < SHORT_S else min(size, len(buffer))
        end = min(end, USB_TELEGRAM_LIMIT)
        if len(buffer) < end:
            return None
        telegram = bytes(buffer[:end])
        del buffer[:end]
        return telegram


def announced_size(head: bytes | bytearray) -> int | None:
    """How long a telegram says it is.

    Args:
        head: How the telegram begins, at least one byte; it is at least so long as returned if it ends too early to
            tell.

    Returns:
        Its size in bytes, or None when it does not say: a `Write`, and what is no declared command.
    """
    if head[0] in (GET_LINK_TYPE, CLOSE):
        return 1
    kind = head[0] & ~NO_REPLY
    if kind not in (Kind.DIRECT, Kind.SYSTEM):
        return None
    if len(head) < REQUEST_HEADER:
        return REQUEST_HEADER
    command = COMMANDS.get((Kind(kind), head[1]))
    if command is None:
        return None
    layout = command.layout
    fixed = REQUEST_HEADER + layout.size
    if not layout.tail:
        return fixed
    if len(head) < fixed:
        return fixed
    if command is SetProperty:
        return fixed + (4 if head[REQUEST_HEADER] == Property.SLEEP_TIME else 1)
    if command not in _DATA_LENGTH:
        return None
    start, end = layout.spans[_DATA_LENGTH[command]]
    return fixed + int.from_bytes(head[REQUEST_HEADER + start : REQUEST_HEADER + end], "little")
