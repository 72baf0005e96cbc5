"""Translate file handles when a recording is replayed on another firmware than it was made with.

A recorded telegram contains a handle that an earlier reply returned. Another firmware may return a different number for
the same file, so the telegram is sent with the number from the replay. The replies of the other firmware were recorded
in the same way.
"""

from __future__ import annotations

from typing import Any

from firmware_protocol.status import Status
from firmware_protocol.system import FindFirst, OpenAppendData, OpenRead, OpenWrite, OpenWriteData, OpenWriteLinear
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, REQUEST_HEADER, Command, Kind

_HANDLE = "handle"
_OPENING = (OpenRead, OpenWrite, OpenWriteLinear, OpenWriteData, OpenAppendData, FindFirst)
_FILL, _ALSO = "!fill", "!also"


class Handles:
    """Map from recorded handles to those of the replay."""

    def __init__(self) -> None:
        self._now: dict[int, int] = {}

    def current(self, handle: int) -> int:
        """Return the handle to send for a recorded one."""
        return self._now.get(handle, handle)

    def translate(self, request: bytes) -> bytes:
        """Return the telegram to send for a recorded one."""
        place = _handle_in_request(request)
        if place is None:
            return request
        return request[:place] + bytes([self.current(request[place])]) + request[place + 1 :]

    def translate_line(self, line: str) -> str:
        """Return the control line for a recorded one, with the telegrams and handles among its arguments translated."""
        word, *arguments = line.split()
        try:
            if word == _FILL:
                arguments[:1] = [f"{self.current(int(handle, 16)):02x}" for handle in arguments[:1]]
            elif word == _ALSO:
                arguments = [self.translate(bytes.fromhex(telegram)).hex() for telegram in arguments]
        except ValueError:
            return line  # the bench reports what is wrong with it
        return " ".join([word, *arguments])

    def learn(self, request: bytes, recorded: bytes, replayed: bytes) -> None:
        """Record the handles that a telegram returned on both sides."""
        place = _handle_in_reply(request)
        if place is None or place >= min(len(recorded), len(replayed)):
            return
        if recorded[REPLY_HEADER - 1] == replayed[REPLY_HEADER - 1] == Status.OK:
            self._now[recorded[place]] = replayed[place]


def _handle_in_request(request: bytes) -> int | None:
    command = _command(request)
    span = command.layout.spans.get(_HANDLE) if command else None
    place = None if span is None else REQUEST_HEADER + span[0]
    return place if place is not None and place < len(request) else None


def _handle_in_reply(request: bytes) -> int | None:
    """Return the offset of the handle in the reply to a telegram that opens a file or starts a search."""
    command = _command(request)
    if command not in _OPENING:
        return None
    return REPLY_HEADER + command.reply_type.layout.spans[_HANDLE][0]


def _command(request: bytes) -> type[Command[Any]] | None:
    if len(request) < REQUEST_HEADER or request[0] & ~NO_REPLY != Kind.SYSTEM:
        return None
    return COMMANDS.get((Kind.SYSTEM, request[1]))
