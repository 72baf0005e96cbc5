"""Trace files: every telegram exchanged with a brick, with its direction and time, to inspect, compare and replay.

JSON lines. The first describes the recording, the others are its events, with seconds since the start::

    {"nxttrace": 1, "address": "usb://0016530A1B2C", "max_telegram": 64, "command": ["info"]}
    {"t": 0.0, "to": "000d"}
    {"t": 0.0021, "from": "020d00c0270900"}
    {"t": 3.2, "error": "LinkLost", "text": "the cable to usb://0016530A1B2C is gone."}
    {"t": 3.3, "to": "000b", "error": "LinkLost", "text": "usb://0016530A1B2C is closed."}
    {"t": 4.0, "reopened": true}
"""

from __future__ import annotations

import errno
import json
import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from firmware_protocol.errors import ConfigError
from firmware_protocol.framing import LENGTH_LIMIT, USB_TELEGRAM_LIMIT
from firmware_protocol.telegram import NO_REPLY
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import InputFileError, NotText, read_text
from nxtdrive.host.unbuffered import write_all
from nxtdrive.host.writing import writing

VERSION = 1
MAX_TIME_S = 1e6
"""Eleven days."""
_RECORD = "Record one with --trace FILE.nxttrace."

HOUSEKEEPING = bytes((NO_REPLY, 0x0D))
"""KeepAlive without a reply: sent by the clock, so it is ignored when traces are compared or replayed."""

log = logging.getLogger(__name__)


class EntryKind(StrEnum):
    """The kind of an entry."""

    TO_BRICK = "to"
    FROM_BRICK = "from"
    ERROR = "error"
    REOPENED = "reopened"


@dataclass(frozen=True, slots=True)
class Entry:
    """One event.

    Attributes:
        time_s: Seconds since the start.
        kind: What happened.
        telegram: The bytes sent or received; empty for other events.
        error: Name of the error's class, see `firmware_protocol.errors`; also set if sending failed.
        text: Message of the error.
    """

    time_s: float
    kind: EntryKind
    telegram: bytes = b""
    error: str = ""
    text: str = ""

    def to_json(self) -> str:
        """Return the entry as a line of the file."""
        value: dict[str, Any] = {"t": round(self.time_s, 6)}
        if self.kind is not EntryKind.ERROR:
            value[self.kind] = True if self.kind is EntryKind.REOPENED else self.telegram.hex()
        if self.error:
            value |= {"error": self.error, "text": self.text}
        return json.dumps(value, ensure_ascii=False)


@dataclass(frozen=True, slots=True)
class Exchange:
    """A request and its outcome.

    Attributes:
        time_s: When the request was sent.
        request: The telegram.
        outcome: Replies and errors until the next request.
    """

    time_s: float
    request: bytes
    outcome: tuple[Entry, ...]

    @property
    def replies(self) -> tuple[bytes, ...]:
        """The received telegrams."""
        return tuple(entry.telegram for entry in self.outcome if entry.kind is EntryKind.FROM_BRICK)


@dataclass(frozen=True, slots=True)
class Trace:
    """A recorded conversation.

    Attributes:
        address: Address of the brick.
        max_telegram: Longest telegram of the link, bytes.
        command: The command line without program, addresses and files; empty if another program was recorded.
        entries: The events, in order.
    """

    address: str
    max_telegram: int
    command: tuple[str, ...] = ()
    entries: tuple[Entry, ...] = ()

    def header(self) -> str:
        """Return the first line of the file."""
        value = {"nxttrace": VERSION, "address": self.address, "max_telegram": self.max_telegram}
        return json.dumps({**value, "command": list(self.command)} if self.command else value)

    def exchanges(self) -> list[Exchange]:
        """Return the conversation, request by request, without keep-alives."""
        groups: list[tuple[Entry, list[Entry]]] = []
        for entry in self.entries:
            if entry.kind is not EntryKind.TO_BRICK:
                if groups:
                    groups[-1][1].append(entry)
            elif entry.telegram != HOUSEKEEPING:
                failure = [replace(entry, kind=EntryKind.ERROR, telegram=b"")] if entry.error else []
                groups.append((entry, failure))
        return [Exchange(entry.time_s, entry.telegram, tuple(outcome)) for entry, outcome in groups]


incomplete: set[Path] = set()
"""Traces of this process that could not be written to their end."""


class TraceWriter:
    """Writes a trace line by line, so that it survives a crash.

    When a line cannot be written, as on a full disk, the trace ends there with a log message; the program continues.

    Args:
        path: The file; an existing one is replaced.
        header: Describes the recording.

    Raises:
        ConfigError: The file cannot be written.
    """

    def __init__(self, path: Path, header: Trace) -> None:
        self._path = path
        incomplete.discard(path)
        with writing(path):
            self._file = path.open("wb", buffering=0)
            with ExitStack() as on_error:
                on_error.callback(self._file.close)
                self._add(header.header())
                on_error.pop_all()

    def write(self, entry: Entry) -> None:
        """Add a line; do nothing if the file is closed."""
        if self._file.closed:
            return
        try:
            self._add(entry.to_json())
        except OSError as error:
            self._end(error)

    def reopen(self) -> None:
        """Continue after `close`."""
        if self._path not in incomplete:
            try:
                self._file = self._path.open("ab", buffering=0)
            except OSError as error:
                self._end(error)

    def close(self) -> None:
        """Close the file; may be called again."""
        if not self._file.closed and not os.path.exists(self._path):
            self._end(FileNotFoundError(errno.ENOENT, "it was removed"))
        self._file.close()

    def _add(self, line: str) -> None:
        write_all(self._file, f"{line}\n".encode(errors="backslashreplace"))

    def _end(self, error: OSError) -> None:
        self._file.close()
        incomplete.add(self._path)
        log.warning("the trace %s is incomplete: it cannot be written (%s).", self._path, error.strerror)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_trace(path: Path) -> Trace:
    """Read a trace; a last line that a crash has cut off is left out, with a warning.

    Raises:
        ConfigError: There is no such file, or it is not a trace; the message names the line.
    """
    try:
        lines = read_text(path, MAX_BYTES).rstrip("\n").split("\n")
    except NotText:
        raise _not_a_trace(path) from None
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    return replace(_header(path, lines[0]), entries=tuple(_entries(path, lines[1:])))


def _not_a_trace(path: Path) -> ConfigError:
    return ConfigError(f"{path} is not a trace of version {VERSION}.", remedy=_RECORD)


def _header(path: Path, line: str) -> Trace:
    """Read the first line."""
    try:
        header = parse_object(line)
    except ValueError:
        header = {}
    if header.get("nxttrace") != VERSION:
        raise _not_a_trace(path)
    address, command, size = header.get("address", ""), header.get("command", []), header.get("max_telegram")
    if not isinstance(address, str):
        mistake = "address must be a text"
    elif not isinstance(command, list) or not all(isinstance(word, str) for word in command):
        mistake = "command must be a list of texts"
    elif type(size) is not int or not USB_TELEGRAM_LIMIT <= size <= LENGTH_LIMIT:
        mistake = f"max_telegram must be a whole number from {USB_TELEGRAM_LIMIT} to {LENGTH_LIMIT}"
    else:
        return Trace(address, size, tuple(command))
    raise ConfigError(f"{path}, line 1: {mistake}.", remedy=_RECORD)


def _entries(path: Path, lines: Sequence[str]) -> Iterator[Entry]:
    for number, line in enumerate(lines, start=2):
        if not line.strip():
            continue
        try:
            yield _entry(parse_object(line))
        except ValueError as error:
            if number == len(lines) + 1:
                log.warning("the trace %s was cut off in its last line, which is left out.", path)
                return
            raise ConfigError(
                f"{path}, line {number} is not an entry of a trace: {line[:60]!r}.",
                remedy="Remove the line, or record again.",
            ) from error


def _entry(value: dict[str, Any]) -> Entry:
    time_s, error, text = value.get("t"), value.get("error", ""), value.get("text", "")
    texts = (error, text, *(value.get(kind, "") for kind in (EntryKind.TO_BRICK, EntryKind.FROM_BRICK)))
    if not isinstance(time_s, int | float) or not all(isinstance(each, str) for each in texts):
        raise ValueError(value)
    if isinstance(time_s, bool) or not 0 <= time_s <= MAX_TIME_S:
        raise ValueError(value)
    for kind in (EntryKind.TO_BRICK, EntryKind.FROM_BRICK):
        if kind in value:
            telegram = bytes.fromhex(value[kind])
            if kind is EntryKind.TO_BRICK and not telegram:
                raise ValueError(value)
            return Entry(time_s, kind, telegram, error, text)
    if error:
        return Entry(time_s, EntryKind.ERROR, error=error, text=text)
    if EntryKind.REOPENED in value:
        return Entry(time_s, EntryKind.REOPENED)
    raise ValueError(value)
