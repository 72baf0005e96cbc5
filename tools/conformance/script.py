"""Read the script of a recording: telegrams in hex, commands by name, waits and notes.

A line is a telegram (``000b``), a command as `nxtdrive send` takes it (``PlayTone frequency_hz=440 duration_ms=100``),
or ``!tick N``, which waits for N milliseconds. Lines that begin with ``#`` are the note of the next one.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from firmware_protocol import direct, enhanced, system
from firmware_protocol.build import build
from firmware_protocol.catalog import DESTRUCTIVE, AnyCommand, command_of
from firmware_protocol.errors import ConfigError, LocalProtocolError
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.telegram import NO_REPLY, REQUEST_HEADER, Kind
from input_files.plain import MEGABYTE, InputFileError, read_text

from .bench import MAX_COUNT

MAX_TELEGRAM_BYTES = 1024

WRITING: frozenset[AnyCommand] = DESTRUCTIVE | {
    enhanced.SetInterpreterState,
    direct.SetProperty,
    system.OpenAppendData,
    system.OpenWrite,
    system.OpenWriteData,
    system.OpenWriteLinear,
    enhanced.RenameFile,
    system.SetBrickName,
    system.Write,
}
"""Commands that change what the brick stores or how it is set up."""

_HEX = re.compile(r"[0-9a-fA-F\s]+")
_NO_REPLY_OPTION = "--no-reply"
_TICK = "!tick"


@dataclass(frozen=True)
class Line:
    """One line of a script.

    Attributes:
        number: In the file, from 1.
        telegram: What to send; empty for a wait.
        wait_ms: How long to wait; 0 for a telegram.
        note: The comment lines before it.
    """

    number: int
    telegram: bytes
    wait_ms: int
    note: str


def read_script(path: Path, *, allow_writes: bool) -> list[Line]:
    """Read a script and check every line of it.

    Args:
        path: The script.
        allow_writes: Accept commands that change what the brick stores, and telegrams whose effect is not known.

    Raises:
        ConfigError: It cannot be read, is empty, or a line cannot or must not be sent; the message names the line.
    """
    try:
        text = read_text(path, MEGABYTE)
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    lines: list[Line] = []
    note: list[str] = []
    for number, words in enumerate(map(str.strip, text.split("\n")), 1):
        if words.startswith("#"):
            note.append(words.lstrip("# "))
        elif words:
            line = _line(words, number, " ".join(note), f"{path}, line {number}")
            if not allow_writes and (objection := _reason_to_refuse(line.telegram)):
                raise ConfigError(
                    f"{path}, line {number}: {objection}.", remedy="Leave the line out, or add --allow-writes."
                )
            lines.append(line)
            note = []
    if not lines:
        raise ConfigError(f"{path} has no telegrams.", remedy="Write one per line, as in GetBatteryLevel or 00 0b.")
    return lines


def _line(words: str, number: int, note: str, place: str) -> Line:
    if words.startswith("!"):
        return Line(number, b"", _wait_ms(words, place), note)
    if _HEX.fullmatch(words):
        digits = "".join(words.split())
        if len(digits) % 2 or len(digits) > 2 * MAX_TELEGRAM_BYTES:
            raise ConfigError(f"{place}: {words[:60]!r} is not a telegram.", remedy="A byte is two hex digits: 00 0b.")
        return Line(number, bytes.fromhex(digits), 0, note)
    try:
        name, *fields = shlex.split(words)
        want_reply = _NO_REPLY_OPTION not in fields
        command = build(name, [field for field in fields if field != _NO_REPLY_OPTION])
        return Line(number, command.encode(want_reply=want_reply), 0, note)
    except (LocalProtocolError, ValueError) as error:
        raise ConfigError(f"{place}: {error}") from None


def _wait_ms(words: str, place: str) -> int:
    word, *arguments = words.split()
    if word != _TICK:
        raise ConfigError(
            f"{place}: {word} acts on the simulated hardware of `nxtdrive sim check`, which a real brick lacks.",
            remedy=f"Use {_TICK} N to wait for N milliseconds, and do the rest by hand.",
        )
    if len(arguments) == 1 and re.fullmatch(r"[0-9]{1,6}", arguments[0]):
        wait_ms = int(arguments[0])
        if 0 < wait_ms <= MAX_COUNT:
            return wait_ms
    raise ConfigError(f"{place}: {words!r} is not a valid wait.", remedy=f"Write {_TICK} N, N from 1 to {MAX_COUNT}.")


def _reason_to_refuse(telegram: bytes) -> str:
    """Return why a telegram is only sent if writes are allowed; empty if it is harmless, or none."""
    if not telegram:
        return ""
    if len(telegram) < REQUEST_HEADER:
        return "the brick completes a telegram of one byte with the one before, which may delete or write"
    if len(telegram) > USB_TELEGRAM_LIMIT:
        return f"of more than {USB_TELEGRAM_LIMIT} bytes the brick takes the rest for another telegram"
    kind = telegram[0] & ~NO_REPLY
    command = command_of(Kind(kind), telegram[1]) if kind in (Kind.DIRECT, Kind.SYSTEM) else None
    if command in WRITING:
        return f"{command.__name__} changes what the brick stores"
    if kind == Kind.SYSTEM and command is None:
        return f"what the system command 0x{telegram[1]:02x} does is not known"
    return ""
