"""Trace files: every telegram of a conversation with its direction and time, to look at, to compare and to replay.

A line of JSON each. The first says what was recorded, the others what happened, in seconds since the beginning::

    {"nxttrace": 1, "address": "usb://0016530A1B2C", "max_telegram": 64, "command": ["info"]}
    {"t": 0.0, "to": "000d"}
    {"t": 0.0021, "from": "020d00c0270900"}
    {"t": 3.2, "error": "LinkLost", "text": "the cable to usb://0016530A1B2C is gone."}
    {"t": 3.3, "to": "000b", "error": "LinkLost", "text": "usb://0016530A1B2C is closed."}
    {"t": 4.0, "reopened": true}
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from firmware_protocol.errors import ConfigError
from firmware_protocol.telegram import NO_REPLY

VERSION = 1
SUFFIX = ".nxttrace"
_RECORD = "Record one with --trace FILE.nxttrace."

HOUSEKEEPING = bytes((NO_REPLY, 0x0D))
"""KeepAlive without a reply: when it is sent depends on the clock, so it is part of no conversation."""


class Kind(StrEnum):
    """What a line tells of."""

    TO_BRICK = "to"
    FROM_BRICK = "from"
    ERROR = "error"
    REOPENED = "reopened"


@dataclass(frozen=True, slots=True)
class Entry:
    """One thing that happened.

    Attributes:
        time_s: Since the beginning.
        kind: What.
        telegram: What was sent or received; empty for the others.
        error: Name of the class of an error, see `firmware_protocol.errors`; also of one that sending ended in.
        text: Its message.
    """

    time_s: float
    kind: Kind
    telegram: bytes = b""
    error: str = ""
    text: str = ""

    def to_json(self) -> str:
        """Its line."""
        value: dict[str, Any] = {"t": round(self.time_s, 6)}
        if self.kind is not Kind.ERROR:
            value[self.kind] = True if self.kind is Kind.REOPENED else self.telegram.hex()
        if self.error:
            value |= {"error": self.error, "text": self.text}
        return json.dumps(value, ensure_ascii=False)


@dataclass(frozen=True, slots=True)
class Exchange:
    """A request and what came of it.

    Attributes:
        time_s: When it was sent.
        request: The telegram.
        outcome: What was received, and errors, until the next request.
    """

    time_s: float
    request: bytes
    outcome: tuple[Entry, ...]

    @property
    def replies(self) -> tuple[bytes, ...]:
        """What was received."""
        return tuple(entry.telegram for entry in self.outcome if entry.kind is Kind.FROM_BRICK)


@dataclass(frozen=True, slots=True)
class Trace:
    """A recorded conversation.

    Attributes:
        address: Of the brick.
        max_telegram: Of its link, bytes.
        command: The command line without its program, addresses and files; empty if it was another program.
        entries: What happened, in order.
    """

    address: str
    max_telegram: int
    command: tuple[str, ...] = ()
    entries: tuple[Entry, ...] = field(default=())

    def header(self) -> str:
        """The first line."""
        value = {"nxttrace": VERSION, "address": self.address, "max_telegram": self.max_telegram}
        return json.dumps({**value, "command": list(self.command)} if self.command else value)

    def exchanges(self) -> list[Exchange]:
        """The conversation, request by request, without housekeeping."""
        groups: list[tuple[Entry, list[Entry]]] = []
        for entry in self.entries:
            if entry.kind is not Kind.TO_BRICK:
                if groups:
                    groups[-1][1].append(entry)
            elif entry.telegram != HOUSEKEEPING:
                failure = [replace(entry, kind=Kind.ERROR, telegram=b"")] if entry.error else []
                groups.append((entry, failure))
        return [Exchange(entry.time_s, entry.telegram, tuple(outcome)) for entry, outcome in groups]


class TraceWriter:
    """Writes a trace, line by line, so that what happened before a crash is there."""

    def __init__(self, path: Path, header: Trace | None) -> None:
        """Open the file.

        Args:
            path: Where; what was there is replaced, unless it is continued.
            header: What is recorded, or None to continue a trace.

        Raises:
            ConfigError: It cannot be written.
        """
        try:
            self._file: IO[str] = path.open("a" if header is None else "w", encoding="utf-8")
        except OSError as error:
            raise ConfigError(
                f"the trace {path} cannot be written ({error.strerror}).", remedy="Name a file in a folder that exists."
            ) from error
        if header is not None:
            self._file.write(header.header() + "\n")

    def write(self, entry: Entry) -> None:
        """Add a line; nothing happens when the file is closed."""
        if self._file.closed:
            return
        self._file.write(entry.to_json() + "\n")
        self._file.flush()

    def close(self) -> None:
        """Close the file; may be called again."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_trace(path: Path) -> Trace:
    """Read a trace; a last line that was cut by a crash is left out.

    Raises:
        ConfigError: There is no such file, or it is no trace; the message names the line.
    """
    try:
        lines = path.read_text(encoding="utf-8").rstrip("\n").split("\n")
    except OSError as error:
        raise ConfigError(f"the trace {path} cannot be read ({error.strerror}).", remedy="Check the path.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is no trace, it is no text.", remedy=_RECORD) from error
    header = _object(lines[0])
    if header.get("nxttrace") != VERSION:
        raise ConfigError(f"{path} is no trace of version {VERSION}.", remedy=_RECORD)
    return Trace(
        address=str(header.get("address", "")),
        max_telegram=_whole(header.get("max_telegram"), path),
        command=tuple(map(str, header.get("command", ()))),
        entries=tuple(_entries(path, lines[1:])),
    )


def _whole(value: object, path: Path) -> int:
    if not isinstance(value, int) or value < 1:
        raise ConfigError(f"{path}, line 1: max_telegram must be a whole number.", remedy=_RECORD)
    return value


def _entries(path: Path, lines: Iterable[str]) -> Iterator[Entry]:
    lines = list(lines)
    for number, line in enumerate(lines, start=2):
        if not line.strip():
            continue
        try:
            yield _entry(_object(line))
        except (KeyError, TypeError, ValueError) as error:
            if number == len(lines) + 1:
                return
            raise ConfigError(
                f"{path}, line {number} is no entry of a trace: {line[:60]!r}.",
                remedy="Remove the line, or record again.",
            ) from error


def _entry(value: dict[str, Any]) -> Entry:
    time_s, error, text = float(value["t"]), str(value.get("error", "")), str(value.get("text", ""))
    for kind in (Kind.TO_BRICK, Kind.FROM_BRICK):
        if kind in value:
            return Entry(time_s, kind, bytes.fromhex(value[kind]), error, text)
    if error:
        return Entry(time_s, Kind.ERROR, error=error, text=text)
    if Kind.REOPENED in value:
        return Entry(time_s, Kind.REOPENED)
    raise ValueError(value)


def _object(line: str) -> dict[str, Any]:
    try:
        value = json.loads(line)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}
