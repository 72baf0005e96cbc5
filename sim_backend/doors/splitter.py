"""Split a stream of telegrams without delimiters.

nxt-python's server protocol sends bare telegrams, so that a burst arrives in one piece. For most commands the first
bytes determine the length; the others end where the stream pauses.
"""

from __future__ import annotations

from typing import Any

from firmware_protocol.direct import LSWrite, MessageWrite, SetProperty
from firmware_protocol.enums import Property
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.system import IOMapWrite
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REQUEST_HEADER, Command, Kind

GET_LINK_TYPE, CLOSE = 0x98, 0x99
"""One-byte telegrams to the server itself: query of the link type, and end of the connection."""

END_S = 0.002
"""Pause that ends a telegram of unknown length: two passes of the brick. Data sent at once arrives at once, up to far
more than a telegram."""

SHORT_S = 0.5
"""Pause after which an incomplete telegram counts as a short one, which the brick accepts as well."""

_DATA_LENGTH: dict[type[Command[Any]], str] = {
    MessageWrite: "size",
    LSWrite: "tx_length",
    IOMapWrite: "size",
}
"""Commands with data at the end, and the field with its length."""


class TelegramSplitter:
    """Splits bytes into telegrams of at most one USB packet."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._buffer += data

    def next(self, silent_s: float) -> bytes | None:
        """Return the next telegram, or None until more bytes arrive or the pause is long enough.

        Args:
            silent_s: Time since the last byte.
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
    """Return the length of a telegram as determined by its first bytes.

    Args:
        head: The start of the telegram, at least one byte.

    Returns:
        The size in bytes, a lower bound if `head` is too short; None for a `Write` and for unknown commands.
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
    if not layout.tail or len(head) < fixed:
        return fixed
    if command is SetProperty:
        return fixed + (4 if head[REQUEST_HEADER] == Property.SLEEP_TIME else 1)
    if command not in _DATA_LENGTH:
        return None
    start, end = layout.spans[_DATA_LENGTH[command]]
    return fixed + int.from_bytes(head[REQUEST_HEADER + start : REQUEST_HEADER + end], "little")
