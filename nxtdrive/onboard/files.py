"""The brick's file system, guarded against defects of the firmware.

Operations run one at a time from start to end, so that nothing is deleted or aborted while a download is open. Every
handle is closed, and empty files and wildcards are refused where the firmware mishandles them. The defects:
docs/firmware.md section 1, facts 8, 9, 17, 18, 19, and docs/traps.md.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase

from firmware_protocol.errors import BrickBusy, BrickError, LinkError, LocalProtocolError, NXTError, RemoteProtocolError
from firmware_protocol.status import Status
from firmware_protocol.system import (
    Close,
    Delete,
    FileFound,
    FindFirst,
    FindNext,
    GetDeviceInfo,
    GetVersions,
    OpenRead,
    OpenWrite,
    Read,
    Write,
)
from nxtdrive.link.link import Link
from nxtdrive.link.transfer import in_step, pieces
from nxtdrive.ports import of_type

NAME_LIMIT = 19
"""Characters of a name, the dot included. Source: docs/firmware.md section 5, "File system"."""
EVERYTHING = "*.*"
"""The firmware's pattern for all files; its other patterns differ from those of a shell (section 5)."""
LISTED_LIMIT = 256
"""More files than any firmware's directory has; 1.29 has 127 entries."""
FLASH_SIZE = 256 * 1024
"""Bytes of the brick's flash; no file is larger. Source: LEGO's hardware developer kit."""
SECTOR, POINTER, FIRST_POINTERS = 256, 2, 34
"""Bytes of a sector, and what the header takes for each and once; it is rounded up to 4 bytes. Source: section 5."""
NO_FILE = "/"
"""A name that no file has; even a refused deletion makes the brick count its free sectors (section 5, 9B)."""
READ_OVERHEAD = 6
WRITE_OVERHEAD = 3
"""Bytes around the data in a Read reply and a Write request. With them a telegram fills the brick's buffer exactly:
58 and 61 data bytes over USB, 122 and 125 over Bluetooth (section 2)."""

Progress = Callable[[int, int], object]
"""Called with the number of bytes transferred so far and in all."""


@dataclass(frozen=True, slots=True)
class FileEntry:
    """A file on the brick.

    Attributes:
        name: As stored.
        size: Bytes.
    """

    name: str
    size: int


class Files:
    """The files on a brick. May be used from several threads; operations wait for each other.

    A handle that could not be closed, since the brick did not answer, is closed before the next operation. If the link
    is lost during an operation over Bluetooth, its handle stays open until the brick is switched off; over USB it is
    closed.

    Args:
        link: The link to the brick.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._lock = threading.Lock()
        self._owner = 0
        self._unclosed: list[tuple[int, object]] = []

    def ls(self, pattern: str = "*") -> list[FileEntry]:
        """List files whose names match a pattern as in a shell, ignoring case, sorted by name."""
        of_type("pattern", pattern, str)
        with self.exclusive():
            listing = in_step(self._link, lambda: self._listing(EVERYTHING))
        found = [FileEntry(each.name, each.size) for each in listing]
        matching = [entry for entry in found if fnmatchcase(entry.name.lower(), pattern.lower())]
        return sorted(matching, key=lambda entry: entry.name.lower())

    def exists(self, name: str) -> bool:
        """Return whether there is a file of this name, ignoring case."""
        with self.exclusive():
            return in_step(self._link, lambda: self._find(_checked(name))) is not None

    def read(self, name: str, progress: Progress | None = None) -> bytes:
        """Read a file.

        Raises:
            LocalProtocolError: The name is not valid.
            BrickError: There is no such file, or no handle is free.
            LinkError: The link failed.
            RemoteProtocolError: The brick did not send the whole file.
        """
        _checked(name)
        with self.exclusive():
            return in_step(self._link, lambda: self._read(name, progress))

    def write(self, name: str, data: bytes, progress: Progress | None = None, *, replace: bool = False) -> None:
        """Create a file; programs (.rxe, .rtm, .sys) get the contiguous block they need.

        Args:
            name: At most 19 characters.
            data: Its content, at least one byte.
            progress: Called after each piece.
            replace: Whether an existing file of this name is deleted first, if that makes room enough; else it is an
                error. What fails later, such as the link or the search for a contiguous block, loses the old file too.

        Raises:
            LocalProtocolError: The name is not valid, or the data is empty or not bytes; nothing was sent.
            BrickError: The file exists, there is no room, no handle is free; the brick has no part of the file.
            BrickBusy: Another transfer to a file of this name was not ended.
            LinkError: The link failed; the brick has no part of the file.
            RemoteProtocolError: The brick lists the file with another size; it stays there.
        """
        _checked(name)
        if not isinstance(data, bytes | bytearray | memoryview):
            raise LocalProtocolError(f"data must be bytes, not {type(data).__name__}.")
        data = bytes(data)
        if not data:
            raise LocalProtocolError(
                f"{name} would be empty, and the brick loses a handle over each empty file it opens.",
                remedy="Write at least one byte.",
            )
        with self.exclusive():
            if replace and (old := in_step(self._link, lambda: self._find(name))) is not None:
                self._check_room(len(data), old.size)
                with _suppress_not_found():
                    self._link.request(Delete(name))
            with self._closing(self._create(name, len(data))) as handle:
                self._write(handle, data, progress)
            entry = in_step(self._link, lambda: self._find(name))
            if entry is None or entry.size != len(data):
                raise RemoteProtocolError(f"the brick stored {name} incorrectly.", remedy="Write it again.")

    def delete(self, name: str) -> None:
        """Delete a file.

        Raises:
            LocalProtocolError: The name is not valid; a wildcard would delete the first match.
            BrickError: There is no such file, or it is in use.
        """
        with self.exclusive():
            self._link.request(Delete(_checked(name)))

    @property
    def free_bytes(self) -> int:
        """Free flash, bytes; each file also needs a header of 36 bytes, and whole sectors of 256."""
        return self._link.request(GetDeviceInfo()).free_flash

    def _check_room(self, size: int, deleted: int) -> None:
        """Check that there is room for `size` bytes once a file of `deleted` bytes is gone.

        Raises:
            BrickError: There is not.
        """
        sectors = _sectors(size) - _sectors(deleted)
        if sectors > _free_sectors(self.free_bytes):
            with _suppress_not_found():
                self._link.request(Delete(NO_FILE))  # those of an aborted download are not counted as free yet
            if sectors > _free_sectors(self.free_bytes):
                raise BrickError(Status.NO_SPACE, OpenWrite.__name__)

    def _read(self, name: str, progress: Progress | None) -> bytes:
        doubted = None
        while True:
            entry = self._find(name)
            if entry is not None and not entry.size:
                if doubted == (0, 0):
                    return b""  # opening it would close handle 0, used or not, and lose its own handle
                doubted = 0, 0
                continue
            opened = self._link.request(OpenRead(name))
            with self._closing(opened.handle):
                listed = entry.size if entry else 0
                sizes = opened.size, listed
                # a data file that a program has not filled is shorter than its entry, and says so again
                agree = opened.size == listed or (sizes == doubted and opened.size < listed)
                if agree and 0 < listed <= FLASH_SIZE:
                    return self._content(opened.handle, opened.size, progress)
            if doubted:
                raise RemoteProtocolError(
                    f"{name} has {listed} bytes in the list of files and {opened.size} when opened.",
                    remedy="Try again, or use the cable.",
                )
            doubted = sizes

    def _content(self, handle: int, size: int, progress: Progress | None) -> bytes:
        content = bytearray()
        for _, wanted in pieces(size, self._link.max_telegram - READ_OVERHEAD):
            piece = self._link.request(Read(handle, wanted)).data
            if len(piece) < wanted:
                raise RemoteProtocolError(f"{wanted} bytes of a file were asked for", piece)
            content += piece[:wanted]
            if progress:
                progress(len(content), size)
        return bytes(content)

    def _create(self, name: str, size: int) -> int:
        """Begin a file; returns its handle.

        Raises:
            BrickBusy: Another transfer to a file of this name was not ended.
            BrickError: The file exists, there is no room, no handle is free.
        """
        try:
            return self._link.request(OpenWrite(name, size)).handle
        except BrickError as error:
            if error.status is Status.FILE_EXISTS and in_step(self._link, lambda: self._find(name)) is None:
                raise BrickBusy(
                    f"{name} is being written, or a transfer of it was cut off.",
                    remedy="Wait for the other program, or switch the brick off and on.",
                ) from error
            raise

    def _write(self, handle: int, data: bytes, progress: Progress | None) -> None:
        step = self._link.max_telegram - WRITE_OVERHEAD
        for start in range(0, len(data), step):
            piece = data[start : start + step]
            self._link.request(Write(handle, piece))  # OK: all of it; the size of the file is compared afterwards
            if progress:
                progress(start + len(piece), len(data))

    def _find(self, name: str) -> FileFound | None:
        """Find the file of exactly this name."""
        found = self._listing(name)
        if found and found[0].name.lower() != name.lower():
            raise RemoteProtocolError(f"the brick was asked for {name} and found {found[0].name}.")
        return found[0] if found else None

    def _listing(self, pattern: str) -> list[FileFound]:
        found: list[FileFound] = []
        with _suppress_not_found():
            entry = self._link.request(FindFirst(pattern))
            with self._closing(entry.handle):
                while len(found) < LISTED_LIMIT:
                    found.append(entry)
                    entry = self._link.request(FindNext(found[0].handle))
                raise RemoteProtocolError(f"the list of files has no end after {LISTED_LIMIT} names.")
        if len({entry.name for entry in found}) < len(found):
            raise RemoteProtocolError("the brick lists a file name twice.", remedy="Try again.")
        if not found:
            self._link.request(GetVersions())  # shows whether the refusal was an earlier one
        return found

    @contextmanager
    def _closing(self, handle: int) -> Iterator[int]:
        """Close a handle afterwards; an error in the block takes precedence over one of closing."""
        try:
            yield handle
        except BaseException:
            with suppress(NXTError):
                self._close(handle)
            raise
        self._close(handle)

    def _close(self, handle: int) -> None:
        try:
            self._link.request(Close(handle))
        except LinkError:
            self._unclosed.append((handle, self._link.transport))
            raise

    def _close_rest(self) -> None:
        """Close the handles that a silent brick left open; over another link their numbers may be those of others."""
        while self._unclosed:
            handle, transport = self._unclosed.pop()
            if transport is self._link.transport:
                with suppress(BrickError):  # the request was lost or the reply; in the latter case it is closed
                    self._close(handle)

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Exclude file operations during a block; a sound or a start would close their handle (fact 21).

        Raises:
            LocalProtocolError: This thread is in the middle of a file operation.
        """
        if self._owner == threading.get_ident():
            raise LocalProtocolError("this cannot begin while a file operation reports its progress.")
        with self._lock:
            self._owner = threading.get_ident()
            try:
                self._close_rest()
                yield
            finally:
                self._owner = 0


@contextmanager
def _suppress_not_found() -> Iterator[None]:
    """Suppress FILE_NOT_FOUND."""
    try:
        yield
    except BrickError as error:
        if error.status is not Status.FILE_NOT_FOUND:
            raise


def _sectors(size: int) -> int:
    """Return the number of sectors of a file."""
    sectors = -(-(size + FIRST_POINTERS) // (SECTOR - POINTER))
    header = -(-(FIRST_POINTERS + sectors * POINTER) // 4) * 4
    return sectors + (sectors * SECTOR - header < size)


def _free_sectors(free_bytes: int) -> int:
    """Return the number of free sectors; the brick reports what a file of all of them holds, up to 2 bytes less."""
    return (free_bytes + FIRST_POINTERS + POINTER) // (SECTOR - POINTER)


def _checked(name: str) -> str:
    """Return `name` if it is valid.

    Raises:
        LocalProtocolError: It is not.
    """
    printable = isinstance(name, str) and name.isascii() and name.isprintable()
    if not printable or not 0 < len(name) <= NAME_LIMIT or set(name) & set("*?/\\"):
        raise LocalProtocolError(
            f"{name!r} is not a valid name for a file on the brick.",
            remedy=f"Names have 1 to {NAME_LIMIT} ASCII characters, the dot included, but none of * ? / \\.",
        )
    return name
