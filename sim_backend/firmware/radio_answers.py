"""The radio's answers, as they enter the receive buffer, and what they change. Source: docs/firmware.md section 10."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum, IntEnum, auto
from functools import partial
from typing import Any, NamedTuple

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
    VISIBLE = auto()
    LINK_STATE = auto()
    """By bits that are set."""
    RESETTING = auto()
    REDRAWS = auto()
    """The status bar."""
    FRESH_LINE = auto()
    """Incomplete messages, which are dropped."""
    TABLES = auto()
    """By a call."""


class Change(NamedTuple):
    """A change of the radio.

    Attributes:
        at_ms: When it happens: from the command, and once it is planned, the time itself.
        part: What changes.
        value: What becomes of it: a number, bytes, or a call, by the part.
    """

    at_ms: int
    part: Part
    value: Any = True


def shifted(changes: Sequence[Change], passes: int) -> list[Change]:
    """Return changes that many passes later."""
    return [change._replace(at_ms=change.at_ms + passes) for change in changes]


class RadioState(IntEnum):
    """State of the radio as the user interface shows it, and its requests to the user interface."""

    STARTING = 0
    VISIBLE = 1
    OFF = 4
    REPORTING = 8
    ASKING = 0x40


LINKED = 3
"""The state in the Comm map after a start of the radio."""

STATES, CLEARED = 0x07, 0x06
"""Bits of the radio's own state, and those that its start clears; when it is switched off all bits are lost."""


def _answer(number: int, content: bytes = b"") -> bytes:
    """Return an answer: its length, its number, content, and what makes their sum 0."""
    answer = bytes((len(content) + 3, number)) + content
    return answer + (-sum(answer) & 0xFFFF).to_bytes(2, "big")


def received(message: bytes) -> bytes:
    """Return a message as it enters the receive buffer: the firmware clears its number."""
    return message[:1] + bytes(len(message[1:2])) + message[2:]


_RENAMED, SWITCHED_OFF, _RESTORED = _answer(0x22, b"\0"), _answer(0x32, b"\x50"), _answer(0x26, b"\0")
IS_ON, IS_OFF = _answer(0x1B, b"\1\0"), _answer(0x31, b"\1\0")
"""The last answers of a boot."""

SEARCHES, FOUND_NONE = _answer(0x0E), _answer(0x10)
"""The beginning of a search, for which nothing waits, and its end."""

_VISIBILITY_SET = _answer(0x20, b"\1")

WOKEN, _LISTED, _VERSION = _answer(0x14), _answer(0x19), _answer(0x30, b"\0\1")
_RESTARTED, _VISIBLE = _answer(0x31, b"\0\0"), _answer(0x2D, b"\1")
END_MS = 2
"""How long it takes to end a connection."""
_ON_MS = 7
"""From a start to the answer that the radio is on."""


def padded(name: bytes) -> bytes:
    """Return the field of a name."""
    return name[: NAME_SIZE - 1].ljust(NAME_SIZE, b"\0")


def name_answer(name: bytes) -> bytes:
    """Return the answer with the radio's name, 16 bytes."""
    return _answer(0x2C, name)


def lost_ms(answer: bytes) -> int:
    """Return how long after an answer that is not recognised its operation ends."""
    return 29_998 if answer == FOUND_NONE else 499


def visibility(visible: bool) -> Sequence[Change]:
    """Return the changes of the command to be visible to others or not."""
    return Change(3, Part.ANSWER, _VISIBILITY_SET), Change(3, Part.VISIBLE, visible)


def search(begin: Callable[[], object]) -> Sequence[Change]:
    """Return the changes of a search that finds nothing, with a call as it begins."""
    searches = Change(3, Part.ANSWER, SEARCHES), Change(2, Part.TABLES, begin)
    return *searches, Change(4, Part.ANSWER, FOUND_NONE)


def removed(remove: Callable[[], object]) -> Sequence[Change]:
    """Return the changes of the command to remove a device, which a call removes from the table."""
    return Change(3, Part.ANSWER, _answer(0x17, b"\x53")), Change(2, Part.TABLES, remove)


def after_ends(
    changes: Sequence[Change],
    handles: Sequence[int],
    ends_ms: int,
    end: Callable[[int], object],
    each_ms: int = END_MS,
) -> Sequence[Change]:
    """Return changes after the end of connections.

    Args:
        changes: As without connections.
        handles: Those of the connections.
        ends_ms: When the first one ends.
        end: Removes one from the table.
        each_ms: By how much each one delays what follows.
    """
    delayed = shifted(changes, each_ms * len(handles))
    for place, handle in enumerate(handles):
        delayed += disconnected(ends_ms + each_ms * place, handle, partial(end, handle))
    return delayed


def disconnected(at_ms: int, handle: int, end: Callable[[], object]) -> Sequence[Change]:
    """Return the changes of the end of a connection, which a call removes from the table."""
    answer = Change(at_ms, Part.ANSWER, _answer(0x1A, bytes((1, handle))))
    return answer, Change(at_ms, Part.TABLES, end), Change(at_ms, Part.REDRAWS)


def renamed(at_ms: int, name: bytes) -> Sequence[Change]:
    """Return the changes of a new name, whose answer comes at a time."""
    return Change(at_ms, Part.STORED_NAME, name), Change(at_ms, Part.ANSWER, _RENAMED), Change(at_ms, Part.REDRAWS)


def restored(at_ms: int, name: bytes) -> Sequence[Change]:
    """Return the changes of a reset up to the radio's new start: its first answer comes at a time."""
    return (
        Change(at_ms, Part.STORED_NAME, name),
        Change(at_ms, Part.ANSWER, _RESTORED),
        Change(at_ms, Part.ON),
        Change(at_ms, Part.RESETTING, 1),
        Change(at_ms + 1, Part.STATE, RadioState.OFF),
    )


def woken(at_ms: int) -> list[Change]:
    """Return the changes of the answer that follows the radio's power-on."""
    return [Change(at_ms, Part.ANSWER, WOKEN), Change(at_ms, Part.REDRAWS)]


def started(at_ms: int, name: bytes, address: bytes, *, on_ms: int, last_ms: int, reset: bool) -> list[Change]:
    """Return the changes of a start of the radio, whose first answer comes at `at_ms`."""
    answers = {3: _answer(0x28, address + b"\0"), 4: name_answer(name), 5: _LISTED, 6: _VERSION}
    return [
        *woken(at_ms),
        Change(at_ms + 2, Part.FRESH_LINE),
        *(Change(at_ms + delay, Part.ANSWER, answer) for delay, answer in answers.items()),
        Change(at_ms + 4, Part.NAME, name),
        Change(at_ms + 4, Part.REDRAWS),
        Change(at_ms + 6, Part.REDRAWS),
        Change(at_ms + 8, Part.LINK_STATE, 1),
        Change(at_ms + 9, Part.LINK_STATE, 2),
        Change(at_ms + _ON_MS, Part.ANSWER, _RESTARTED if reset else SWITCHED_OFF),
        Change(at_ms + _ON_MS, Part.RESETTING, 0),
        Change(at_ms + _ON_MS, Part.ON, True),
        Change(at_ms + _ON_MS, Part.STATE, RadioState.STARTING),
        Change(on_ms, Part.ANSWER, _VISIBLE),
        Change(on_ms, Part.STATE, RadioState.VISIBLE),
        Change(last_ms, Part.ANSWER, IS_ON),
    ]
