"""Handles in a recording that is replayed on another firmware than the one it was made with.

A recorded telegram names a handle because an earlier reply gave it. Where the other firmware hands out another number
for the same file, the recording's number would mean another file; so the telegram is sent with the number that the
replayed firmware gave. The replies recorded from the other firmware show that they were made in the same way.
"""

from __future__ import annotations

from typing import Any

from firmware_protocol.status import Status
from firmware_protocol.system import FindFirst, OpenAppendData, OpenRead, OpenWrite, OpenWriteData, OpenWriteLinear
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Command, Kind

_HEADER = 2
_HANDLE = "handle"
_OPENING = (OpenRead, OpenWrite, OpenWriteLinear, OpenWriteData, OpenAppendData, FindFirst)
_FILL, _ALSO = "!fill", "!also"


class Handles:
    """Which number now stands for which number of the recording."""

    def __init__(self) -> None:
        self._now: dict[int, int] = {}

    def current(self, handle: int) -> int:
        """The number to send for a recorded one."""
        return self._now.get(handle, handle)

    def translate(self, request: bytes) -> bytes:
        """The telegram to send for a recorded one."""
        place = _handle_in_request(request)
        if place is None:
            return request
        return request[:place] + bytes([self.current(request[place])]) + request[place + 1 :]

    def translate_line(self, line: str) -> str:
        """The control line to carry out for a recorded one: telegrams and handles can be among its arguments."""
        word, *arguments = line.split()
        try:
            if word == _FILL:
                arguments[:1] = [f"{self.current(int(handle, 16)):02x}" for handle in arguments[:1]]
            elif word == _ALSO:
                arguments = [self.translate(bytes.fromhex(telegram)).hex() for telegram in arguments]
        except ValueError:
            return line  # the bench says what is wrong with it
        return " ".join([word, *arguments])

    def learn(self, request: bytes, recorded: bytes, replayed: bytes) -> None:
        """Take note of the handles that a telegram has opened, on both sides."""
        place = _handle_in_reply(request)
        if place is None or place >= min(len(recorded), len(replayed)):
            return
        if recorded[REPLY_HEADER - 1] == replayed[REPLY_HEADER - 1] == Status.OK:
            self._now[recorded[place]] = replayed[place]


def _handle_in_request(request: bytes) -> int | None:
    command = _command(request)
    span = command.layout.spans.get(_HANDLE) if command else None
    place = None if span is None else _HEADER + span[0]
    return place if place is not None and place < len(request) else None


def _handle_in_reply(request: bytes) -> int | None:
    """Where the reply to a telegram that opens a file or a search has the handle."""
    command = _command(request)
    if command not in _OPENING:
        return None
    return REPLY_HEADER + command.reply_type.layout.spans[_HANDLE][0]


def _command(request: bytes) -> type[Command[Any]] | None:
    if len(request) < _HEADER or request[0] & ~NO_REPLY != Kind.SYSTEM:
        return None
    return COMMANDS.get((Kind.SYSTEM, request[1]))
