"""The radio's answers, as they enter the receive buffer, and what they change. Source: docs/firmware.md section 10."""

from __future__ import annotations

from enum import Enum, IntEnum, auto
from typing import NamedTuple

NAME_SIZE = 16
"""Bytes of the name field; at most 15 count."""

NAME_AT_BOOT = 8
"""Characters of the radio's name that the firmware takes over when the radio starts."""


class Part(Enum):
    """What an answer of the radio changes."""

    ANSWER = auto()
    """The receive buffer, by its content."""
    MESSAGE = auto()
    """The receive buffer, too, but by bytes that arrive, which do not count as answered."""
    NAME = auto()
    STORED_NAME = auto()
    ON = auto()
    STATE = auto()
    LINK_STATE = auto()
    """By bits that are set."""
    RESETTING = auto()
    REDRAWS = auto()
    """The status bar."""


class Change(NamedTuple):
    """A change of the radio.

    Attributes:
        at_ms: When it happens: from the command, and once it is planned, the time itself.
        part: What changes.
        value: What becomes of it.
    """

    at_ms: int
    part: Part
    value: int | bytes = True


class RadioState(IntEnum):
    """State of the radio as the user interface shows it, and its requests to the user interface."""

    STARTING = 0
    VISIBLE = 1
    OFF = 4
    REPORTING = 8
    ASKING = 0x40


def _answer(kind: int, content: bytes = b"") -> bytes:
    """Return an answer: its length, its number, which the firmware clears, content, and what makes their sum 0."""
    return bytes((len(content) + 3, 0)) + content + (-kind - sum(content) & 0xFFFF).to_bytes(2, "big")


RENAMED, SWITCHED_OFF, RESTORED = _answer(0x26, b"\0"), _answer(0x36, b"\x50"), _answer(0x2A, b"\0")
IS_ON, IS_OFF = _answer(0x20, b"\1\0"), _answer(0x36, b"\1\0")
"""The last answers of a boot."""

_WOKEN, _LISTED, _VERSION = _answer(0x17), _answer(0x1C), _answer(0x35, b"\0\1")
_RESTARTED, _VISIBLE = _answer(0x36, b"\0\0"), _answer(0x31, b"\1")
_ON_MS = 7
"""From a start to the answer that the radio is on."""


def name_answer(name: bytes) -> bytes:
    """Return the answer with the radio's name, 16 bytes."""
    return _answer(0x3F, name)


def woken(at_ms: int) -> list[Change]:
    """Return the changes of the answer that follows the radio's power-on."""
    return [Change(at_ms, Part.ANSWER, _WOKEN), Change(at_ms, Part.REDRAWS)]


def started(at_ms: int, name: bytes, address: bytes, *, on_ms: int, last_ms: int, reset: bool) -> list[Change]:
    """Return the changes of a start of the radio, whose first answer comes at `at_ms`."""
    answers = {3: _answer(0x32, address + b"\0"), 4: name_answer(name), 5: _LISTED, 6: _VERSION}
    return [
        *woken(at_ms),
        *(Change(at_ms + delay, Part.ANSWER, answer) for delay, answer in answers.items()),
        Change(at_ms + 4, Part.NAME, name),
        Change(at_ms + 4, Part.REDRAWS),
        Change(at_ms + 6, Part.REDRAWS),
        Change(at_ms + _ON_MS, Part.ANSWER, _RESTARTED if reset else SWITCHED_OFF),
        Change(at_ms + _ON_MS, Part.RESETTING, 0),
        Change(at_ms + _ON_MS, Part.ON, True),
        Change(at_ms + _ON_MS, Part.STATE, RadioState.STARTING),
        Change(on_ms, Part.ANSWER, _VISIBLE),
        Change(on_ms, Part.STATE, RadioState.VISIBLE),
        Change(last_ms, Part.ANSWER, IS_ON),
    ]
