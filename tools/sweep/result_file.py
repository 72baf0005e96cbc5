"""The file of a sweep: one line of JSON per mission, in the order of the tasks."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from pydantic import ValidationError

from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import InputFileError, read_bytes
from input_files.pydantic_words import first_mistake
from nxtdrive.host.unbuffered import write_all

from .mission_result import MissionResult

BEGIN = b'{"episode_index": '
"""How each line begins, even one that an interruption cut short."""
ANOTHER = "Choose another file with --out."


def read_results(path: Path) -> list[MissionResult]:
    """Return the results in a sweep's file, except a last line that an interruption cut short.

    Raises:
        ConfigError: The file cannot be read, or is not a sweep's.
    """
    lines = whole_lines(path, BEGIN, lambda number: _foreign(path, number))
    return [_result(path, number, text) for number, text in enumerate(lines, start=1)]


def whole_lines(path: Path, begin: bytes, foreign: Callable[[int], ConfigError]) -> list[bytes]:
    """Return the lines of a file, if there is one, except a last line that an interruption cut short.

    Args:
        path: The file.
        begin: How each line begins.
        foreign: Makes the error for a last line, by its number, that begins in another way.

    Raises:
        ConfigError: The file cannot be read, or is another program's.
    """
    if not os.path.lexists(path):
        return []
    try:
        *whole, rest = read_bytes(path, MAX_BYTES).split(b"\n")
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    if rest[: len(begin)] != begin[: len(rest)]:
        raise foreign(len(whole) + 1)
    return whole


def _result(path: Path, number: int, text: bytes) -> MissionResult:
    try:
        parse_object(text.decode())
        return MissionResult.model_validate_json(text)
    except ValidationError as error:
        raise _foreign(path, number, f": {first_mistake(error.errors())}") from None
    except ValueError:
        raise _foreign(path, number) from None


def _foreign(path: Path, number: int, reason: str = "") -> ConfigError:
    return ConfigError(f"{path} is not the file of a sweep (line {number}{reason}).", remedy=ANOTHER)


class ResultFile:
    """Appends lines to the file, after its last complete one.

    Args:
        path: A file of which `whole_lines` accepts the lines, or a new one in a folder that exists.
        remedy: What to do when a line cannot be written.

    Raises:
        ConfigError: It cannot be written.
    """

    def __init__(self, path: Path, remedy: str = "Make room, and continue with --resume.") -> None:
        self._path, self._remedy = path, remedy
        try:
            self._file = path.open("ab+", buffering=0)
            self._file.seek(0)
            self._file.truncate(self._file.read().rfind(b"\n") + 1)
        except OSError as error:
            raise ConfigError(f"{path} cannot be written: {error.strerror}.", remedy=ANOTHER) from error

    def append(self, line: str) -> None:
        """Write a line of JSON at once.

        Raises:
            ConfigError: It cannot be written; the lines before it are in the file.
        """
        try:
            write_all(self._file, line.encode() + b"\n")
        except OSError as error:
            raise ConfigError(
                f"{self._path} cannot be written ({error.strerror}); the results before are in it.",
                remedy=self._remedy,
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
