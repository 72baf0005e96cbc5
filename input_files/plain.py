"""Read a whole file as bytes or as text."""

from __future__ import annotations

import gzip
import io
import os
import stat
import zlib
from collections.abc import Iterator
from pathlib import Path, PureWindowsPath
from typing import Any, TypeGuard

from input_files.mistakes import excerpt, nearest

MEGABYTE = 1_000_000
MAX_DEPTH = 32
"""How deep tables, lists and objects may be nested; ours need 6."""

IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".webp", ".tif", ".tiff", ".ppm"})
"""Of images that are read."""
PICTURE_SUFFIXES = IMAGE_SUFFIXES | {".gif", ".heic", ".heif", ".avif"}
"""Of all pictures, those that have to be saved in another format included."""

MAX_DIGITS = 18
"""Of a whole number that fits 64 bits; Python itself refuses to read one of thousands."""


class InputFileError(ValueError):
    """A file that cannot be used; the message names it, says what is wrong and what to do."""


class NotText(InputFileError):
    """A file that is not text in UTF-8."""


def read_bytes(path: Path, limit: int) -> bytes:
    """Read a regular file.

    Args:
        path: The file. Folders, devices and pipes are refused, because reading them may never end.
        limit: Most bytes it may have.

    Raises:
        InputFileError: It cannot be read, or is too large.
    """
    try:
        found = os.stat(path)
        if stat.S_ISDIR(found.st_mode):
            raise InputFileError(f"{path} is a folder. Choose a file in it.")
        if not stat.S_ISREG(found.st_mode):
            raise InputFileError(f"{path} is a device or a pipe. Name a regular file.")
        with open(path, "rb") as file:
            content = file.read(limit + 1) if found.st_size <= limit else None
    except OSError as error:
        meant = similar_file(path) if isinstance(error, FileNotFoundError) else None
        denied = isinstance(error, PermissionError)
        remedy = f"Did you mean {meant}?" if meant else f"Check the {'permissions' if denied else 'path'}."
        raise InputFileError(f"{path}: cannot be read ({error.strerror}). {remedy}") from None
    except InputFileError:
        raise
    except ValueError as error:  # a NUL in the path
        raise InputFileError(f"{str(path)!r} cannot be read ({error}). Check the path.") from None
    if content is None or len(content) > limit:
        raise _too_large(path, limit)
    return content


def refuse_empty(path: Path, size: int) -> None:
    """Refuse a file without content, as an interrupted copy or download leaves it.

    Args:
        path: The file.
        size: Its bytes.

    Raises:
        InputFileError: It has none.
    """
    if not size:
        raise InputFileError(f"{path} is empty. Copy it again.")


def similar_file(path: Path) -> Path | None:
    """Return the file beside a path that was probably meant: of a similar name or ending, or with an ending at all."""
    suffix = path.suffix.lower()
    try:
        files = sorted(each for each in path.parent.iterdir() if each.is_file())
    except (OSError, ValueError):  # there is no such folder, or none can have that name
        return None
    same_kind = {each.stem: each for each in files if each.suffix.lower() == suffix}
    same_stem = {each.suffix: each for each in files if each.stem == path.stem}
    endings = (each for each in files if each.stem == path.name)
    return (
        same_kind.get(nearest(path.stem, same_kind)) or same_stem.get(nearest(suffix, same_stem)) or next(endings, None)
    )


def missing_file(file: str, folder: Path, kind: str) -> str:
    """Return the name of a file that another one needs and that is not there, with what to do.

    Args:
        file: Its name in that other file.
        folder: That of the other file.
        kind: What the other file is: ``mission``.
    """
    path = folder / at_home(file)
    if os.path.isdir(path):
        return f"{excerpt(file)}; that is a folder, so name a file in it"
    windows = PureWindowsPath(file)
    for each in (windows.as_posix(), windows.name):  # of a mission that was written on another computer
        if os.path.isfile(folder / each):
            return f"{excerpt(file)}; write {excerpt(each)}"
    similar = similar_file(path)
    meant = f"did you mean {excerpt(similar.name)}? Else " if similar else ""
    return f"{excerpt(file)}; {meant}put it beside the {kind} file ({folder.resolve()})"


def read_text(path: Path, limit: int) -> str:
    """Read a regular file in UTF-8, with or without a byte order mark; line ends become line feeds.

    Args:
        path: The file; one whose name ends in ``.gz`` is decompressed.
        limit: Most bytes it may have, also when it is decompressed.

    Raises:
        NotText: It is not UTF-8.
        InputFileError: It cannot be read, or is too large.
    """
    content = read_bytes(path, limit)
    if path.suffix == ".gz":
        content = _decompressed(path, content, limit)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise NotText(f"{path} is not a text file in UTF-8: see line {line}. Save it as UTF-8.") from None
    return text.replace("\r\n", "\n")


def _decompressed(path: Path, content: bytes, limit: int) -> bytes:
    try:
        plain = gzip.GzipFile(fileobj=io.BytesIO(content)).read(limit + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputFileError(f"{path} cannot be decompressed ({error}). Compress it with gzip again.") from None
    if len(plain) > limit:
        raise _too_large(path, limit)
    return plain


def _too_large(path: Path, limit: int) -> InputFileError:
    return InputFileError(f"{path} is too large: more than {limit / MEGABYTE:g} MB. Choose another file.")


def leaves(value: Any) -> Iterator[Any]:  # noqa: ANN401 - any plain value
    """Yield what is in dictionaries and lists that lie in each other.

    Raises:
        ValueError: They are nested more than `MAX_DEPTH` levels deep.
    """
    level = [value]
    for _ in range(MAX_DEPTH + 1):
        tables = [each.values() if isinstance(each, dict) else each for each in level if isinstance(each, dict | list)]
        yield from (each for each in level if not isinstance(each, dict | list))
        level = [inner for table in tables for inner in table]
        if not level:
            return
    raise ValueError(f"nested more than {MAX_DEPTH} levels deep")


def is_too_large(value: Any) -> bool:  # noqa: ANN401 - any plain value
    """Return whether it is a whole number of more than 64 bits, which no format here needs and few libraries take."""
    return isinstance(value, int) and abs(value) >= 2**63


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a plain value is a number; true and false are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def whole_number(text: str) -> int | None:
    """Return the whole number that a text is; None for one of other characters than up to 18 ASCII digits."""
    return int(text) if len(text) <= MAX_DIGITS and text.isascii() and text.isdecimal() else None


def is_utf_8(text: str | Path) -> bool:
    """Return whether a text or path can be written in UTF-8; OpenCV crashes at one that cannot."""
    return str(text).encode(errors="replace").decode() == str(text)


def at_home(text: str | Path) -> Path:
    """Return a path with the user's folder in place of ``~``, which stays where no such user is known."""
    try:
        return Path(os.path.expanduser(text))
    except ValueError:  # a NUL in the user's name
        return Path(text)
