"""The protocol of the thesis's ``tcp`` node: one line per request, one small integer per answer. No I/O here.

A line is ``verb`` or ``verb argument`` or, as BDI agents write literals, ``verb(argument)``; it ends with LF or CRLF.
Each line is answered, in order, by one integer in decimal and LF.

    ============== ===================================== =========================================
    line           does                                  answers
    ============== ===================================== =========================================
    connect        makes sure that the brick answers     0 not connected, 1 connected
    arrive [NAME]  searches, then drives, for a while    0 continue, 1 arrived, 2 failed
    select         moves nothing                         0 not recognised, 1 recognised
    move_to DEG    turns right and advances, or advances 0 moving, 1 done
    bye            ends the session                      0 refused, 1 ended
    stop           stops now, whatever is in progress    1
    target NAME    names what a bare ``arrive`` means    1
    status         checks that the brick answers         see `Status`
    why            moves nothing                         see `Why`
    evidence       moves nothing                         a line of JSON, the only answer that is not an integer
    choose [N]     begins a mission, or takes its         0 another decision, 1 all reached, 2 ended otherwise
                   candidate N
    ============== ===================================== =========================================

The first five are the thesis's. A line that begins with one of them is never answered by anything but 0, 1 or 2, the
only answers that a client of 2017 understands; `THESIS_FAILURES` are those to a request that failed. The others
are ours. Their failures are answered by a negative number, see `ErrorReply`.

Source: docs/thesis.md, architecture and services, reading A7; docs/agentspeak.md.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from types import MappingProxyType

from input_files.mistakes import excerpt

LINE_LIMIT = 256
"""Longest line in bytes, without its LF; a verb with a target's name is far shorter."""

DIRECTION_LIMIT_DEG = 360.0
"""A larger turn is probably a mistake in the unit."""


class Verb(StrEnum):
    """The requests."""

    CONNECT = "connect"
    ARRIVE = "arrive"
    SELECT = "select"
    MOVE_TO = "move_to"
    BYE = "bye"
    STOP = "stop"
    TARGET = "target"
    STATUS = "status"
    WHY = "why"
    EVIDENCE = "evidence"
    CHOOSE = "choose"


MOTIONS = frozenset({Verb.ARRIVE, Verb.MOVE_TO, Verb.CHOOSE})
"""Verbs that move the robot; only these can be interrupted."""

THESIS_FAILURES = MappingProxyType({Verb.CONNECT: 0, Verb.ARRIVE: 2, Verb.SELECT: 0, Verb.MOVE_TO: 1, Verb.BYE: 0})
"""The thesis's verbs and their answers to a request that failed. That of ``move_to`` is not 0: a client of
2017 repeats a ``move_to`` that answered 0, forever if the link is lost."""


class ErrorReply(IntEnum):
    """Answers to failed requests, other than the thesis's."""

    UNKNOWN_VERB = -1
    BAD_ARGUMENT = -2
    LINK_DOWN = -3
    BUSY = -6
    FAULT = -7


class Status(IntEnum):
    """Answers to ``status``; a link that is down answers `ErrorReply.LINK_DOWN`."""

    IDLE = 0
    UNDER_WAY = 1
    HELD = 2


class Why(IntEnum):
    """Answers to ``why``: how the last arrive, move_to or stop ended, or why a command failed."""

    NOTHING_YET = 0
    SIGHTED = 1
    DRIVING_ON = 2
    WITHIN_REACH = 3
    FULL_TURN_WITHOUT_SIGHTING = 4
    TARGET_LOST = 5
    APPROACH_TIMEOUT = 6
    MOVED = 7
    OBSTACLE_AHEAD = 8
    OPERATOR_STOP = 9
    LINK_LOST = 10
    FAULT = 11
    BAD_ARGUMENT = 12
    DECISION_OPEN = 13
    ACHIEVED = 14
    GIVEN_UP = 15
    TIME_UP = 16
    OTHER = 99


@dataclass(frozen=True, slots=True)
class Request:
    """A valid line.

    Attributes:
        verb: Its verb.
        name: The target's name, of ``arrive`` and ``target``; empty where ``arrive`` has none.
        direction_deg: Of ``move_to``, positive right.
        number: Of ``choose``, from 0.
    """

    verb: Verb
    name: str = ""
    direction_deg: float = 0.0
    number: int = 0

    @property
    def argument(self) -> str:
        """The verb's argument, as text."""
        if self.verb is Verb.CHOOSE:
            return str(self.number)
        return f"{self.direction_deg:g}" if self.verb is Verb.MOVE_TO else self.name


@dataclass(frozen=True, slots=True)
class BadLine:
    """A line that is not a request.

    Attributes:
        text: What it says, quoted and cut to be shown.
        error: What is wrong with it.
        verb: The verb it begins with; None for an unknown one.
    """

    text: str
    error: ErrorReply
    verb: Verb | None = None

    @property
    def reply(self) -> int:
        """Its answer."""
        return self.error if self.verb is None else failure_reply(self.verb, self.error)


def failure_reply(verb: Verb, error: ErrorReply) -> int:
    """Return the answer to a failed request: the thesis's if the verb is the thesis's."""
    return THESIS_FAILURES.get(verb, error)


_VERBS: dict[str, Verb] = {verb.value: verb for verb in Verb}
_LINE = re.compile(r"(?P<verb>\w+)(?:\s*\((?P<term>.*)\)|\s+(?P<rest>.*))?", re.DOTALL)
_QUOTED = re.compile(r"(['\"])(.*)\1", re.DOTALL)


def parse(line: bytes) -> Request | BadLine:
    """Parse one line.

    Args:
        line: Its bytes, without the LF.
    """
    text = line.decode("utf-8", errors="replace").strip()
    match = _LINE.fullmatch(text)
    verb = _VERBS.get(match["verb"]) if match else None
    if match is None or verb is None or len(line) > LINE_LIMIT:
        begun = verb or next((each for each in THESIS_FAILURES if text.startswith(each)), None)
        known = begun or len(line) > LINE_LIMIT
        return BadLine(excerpt(text), ErrorReply.BAD_ARGUMENT if known else ErrorReply.UNKNOWN_VERB, begun)
    request = _request(verb, (match["term"] or match["rest"] or "").strip())
    return request or BadLine(excerpt(text), ErrorReply.BAD_ARGUMENT, verb)


def _request(verb: Verb, argument: str) -> Request | None:
    """Return the request; None if the argument does not fit the verb."""
    if quoted := _QUOTED.fullmatch(argument):
        argument = quoted[2]
    match verb:
        case Verb.MOVE_TO:
            return _move_to(argument)
        case Verb.CHOOSE:
            number = argument or "0"
            return Request(verb, number=int(number)) if number.isascii() and number.isdecimal() else None
        case Verb.TARGET:
            return Request(verb, argument) if argument else None
        case Verb.ARRIVE:
            return Request(verb, argument)
    return None if argument else Request(verb)


def _move_to(argument: str) -> Request | None:
    try:
        direction_deg = float(argument)
    except ValueError:
        return None
    # the comparison is false for NaN, too
    return Request(Verb.MOVE_TO, direction_deg=direction_deg) if abs(direction_deg) <= DIRECTION_LIMIT_DEG else None


class RequestReader:
    """Turns received bytes into requests.

    Of a line that is too long it keeps only enough to recognise that.
    """

    def __init__(self) -> None:
        self._line = bytearray()
        self._requests: deque[Request | BadLine] = deque()

    def __len__(self) -> int:
        """Return the number of lines that wait for an answer."""
        return len(self._requests)

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        *ended, rest = data.split(b"\n")
        for part in ended:
            self._add(part)
            self._requests.append(parse(bytes(self._line)))
            self._line.clear()
        self._add(rest)

    def take(self) -> Request | BadLine | None:
        """Return the next line; None without a complete one."""
        return self._requests.popleft() if self._requests else None

    @property
    def stop_waits(self) -> bool:
        """Whether a ``stop`` is among the lines that wait."""
        return Request(Verb.STOP) in self._requests

    def _add(self, part: bytes) -> None:
        self._line += part[: LINE_LIMIT + 1 - len(self._line)]
