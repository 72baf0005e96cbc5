"""The files of ``nxtdrive sweep`` and ``nxtdrive what-if``: one line of JSON per mission."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Self, TypeVar

from pydantic import BaseModel, ValidationError

from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import InputFileError, read_bytes
from input_files.pydantic_words import first_mistake
from nxtdrive.host.unbuffered import write_all
from nxtdrive.recording.output_file import lock

from .mission_result import MissionResult

ANOTHER = "Choose another file with --out."
ENDED = "Wait until it has ended, or choose another file with --out."
Line = TypeVar("Line", bound=BaseModel)


def read_results(path: Path) -> list[MissionResult]:
    """Return the results in a sweep's file, as `read_lines` does."""
    return read_lines(path, MissionResult, "the file of a sweep")


def read_lines(path: Path, model: type[Line], what: str) -> list[Line]:
    """Return the lines of a file, if there is one, except a last line that an interruption cut short.

    Args:
        path: The file.
        model: Model of a line; every line, even one that was cut short, begins with the model's first field.
        what: What the file has to be, for the error.

    Raises:
        ConfigError: The file cannot be read, or is another program's.
    """
    if not os.path.lexists(path):
        return []
    try:
        *whole, rest = read_bytes(path, MAX_BYTES).split(b"\n")
    except InputFileError as error:
        raise ConfigError(str(error)) from None

    def foreign(number: int, reason: str = "") -> ConfigError:
        return ConfigError(f"{path} is not {what} (line {number}{reason}).", remedy=ANOTHER)

    begin = f'{{"{next(iter(model.model_fields))}": '.encode()
    if rest[: len(begin)] != begin[: len(rest)]:
        raise foreign(len(whole) + 1)
    lines = []
    for number, text in enumerate(whole, start=1):
        try:
            parse_object(text.decode())
            lines.append(model.model_validate_json(text))
        except ValidationError as error:
            raise foreign(number, f": {first_mistake(error.errors())}") from None
        except ValueError:
            raise foreign(number) from None
    return lines


class ResultFile:
    """Appends lines to a file, after its last complete one; the only one that does so at a time.

    Args:
        path: A file that `read_lines` accepts, or a new one in a folder that exists.
        remedy: What to do when a line cannot be written.

    Raises:
        ConfigError: It cannot be written, or another program has it open as a `ResultFile`.
    """

    def __init__(self, path: Path, remedy: str = "Free some space, and continue with --resume.") -> None:
        self._path, self._remedy = path, remedy
        try:
            self._file = path.open("ab+", buffering=0)
            if not lock(self._file.fileno(), wait=False):
                self._file.close()
                raise ConfigError(f"another program is writing {path}.", remedy=ENDED)
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

    def __exit__(self, *_: object) -> None:
        self._file.close()
