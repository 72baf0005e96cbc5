"""The loader module: sixteen handles for files and searches. Source: docs/firmware.md section 5.

The firmware's quirks are kept: a search that was never opened can be continued, opening an empty file closes handle 0
and leaks its own, and handles beyond the table can be "closed".
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from typing import NamedTuple

from firmware_protocol.status import Status
from sim_backend.firmware.flash import File, Flash
from sim_backend.firmware.names import matcher
from sim_backend.firmware.versions import Version

HANDLES = 16
WRITERS = 4
NAME_LIMIT = 19

_LINEAR = (".rxe", ".sys", ".rtm")
"""Files whose names contain one of these are contiguous: programs are executed in place."""


def fresh_flash(version: Version) -> Flash:
    """The flash after the first boot."""
    return Flash(version.sectors, version.directory_size, bytes(version.settings_size))


class Use(Enum):
    """Use of a handle."""

    FREE = auto()
    READ = auto()
    WRITE = auto()
    SEARCH = auto()


class Handle:
    """One entry of the table.

    Attributes:
        use: See `Use`.
        file: The open file.
        position: Next byte to read.
        overrun: Whether more was written than announced.
        matches: Test of a search.
        found: Index of the last file found by a search.
        keep: Whether it stays open when the USB cable is pulled.
    """

    __slots__ = ("file", "found", "keep", "matches", "overrun", "position", "use")

    def __init__(self) -> None:
        self.use = Use.FREE
        self.file: File | None = None
        self.position = 0
        self.overrun = self.keep = False
        self.matches: Callable[[str], bool] = lambda _: True
        self.found = 0


class Opened(NamedTuple):
    """Result of opening a file; the handle's number is reported even if it was refused and is free again."""

    status: Status
    handle: int
    size: int = 0


class Loader:
    """The file system.

    Attributes:
        flash: The files.
        free_flash: Free bytes at the last change; closing a file does not refresh it.
    """

    def __init__(self, flash: Flash, version: Version) -> None:
        """Make the module.

        Args:
            flash: The flash at power-on.
            version: The firmware version.
        """
        flash.power_up()
        self.flash = flash
        self.free_flash = flash.free
        self._version = version
        self._handles = [Handle() for _ in range(HANDLES)]

    def exists(self, name: str) -> bool:
        """Whether a file exists; False without a free handle for the search."""
        return self._find(name)[2] is not None

    def open_read(self, name: str, *, keep: bool = False) -> Opened:
        """Open the first file that matches; `keep` leaves it open when the USB cable is pulled."""
        status, number, file = self._find(name)
        if file is None:
            return Opened(status, number)
        if not file.size:
            self._handles[number].use = Use.READ  # the firmware leaks it
            self.close(0)
            return Opened(Status.FILE_NOT_FOUND, 0)
        self._take(number, Use.READ, file, keep=keep)
        return Opened(Status.OK, number, file.data_size)

    def create(
        self, name: str, size: int, *, linear: bool = False, appendable: bool = False, keep: bool = False
    ) -> Opened:
        """Create a file open for writing; it enters the directory at once or when closed complete."""
        program = any(part in name.lower() for part in _LINEAR)
        if appendable and program and self._version.strict_data_names:
            return Opened(Status.ILLEGAL_FILE_NAME, 0)
        status, number = self._allocate(name)
        if status:
            return Opened(status, 0)
        file = File(name, size, appendable)
        status = self._refusal(file) or self._reserve(file, linear=linear or (program and not appendable))
        if status:
            return Opened(status, 0 if status == Status.NO_MORE_FILES else number)
        if appendable:
            self.flash.files.insert(0, file)
        self._take(number, Use.WRITE, file, keep=keep)
        self.free_flash = self.flash.free
        return Opened(Status.OK, number)

    def append(self, name: str, *, keep: bool = False) -> Opened:
        """Open a data file to append; `Opened.size` is the space left."""
        status, number, file = self._find(name)
        if file is None:
            return Opened(status, number)
        if not file.appendable:
            return Opened(Status.APPEND_NOT_POSSIBLE, number)
        if self._is_open(file, Use.WRITE):
            return Opened(Status.FILE_IS_BUSY, number)
        if file.data_size >= file.size:
            return Opened(Status.FILE_IS_FULL, number)
        self._take(number, Use.WRITE, file, keep=keep)
        return Opened(Status.OK, number, file.size - file.data_size)

    def read(self, number: int, size: int) -> tuple[Status, bytes]:
        """Read on; fewer bytes at the end of the file."""
        handle = self._handle(number, Use.READ)
        if handle is None or handle.file is None:
            return Status.ILLEGAL_HANDLE, b""
        data = bytes(handle.file.content[handle.position : min(handle.position + size, handle.file.data_size)])
        handle.position += len(data)
        return (Status.OK if len(data) == size else Status.END_OF_FILE), data

    def write(self, number: int, data: bytes) -> tuple[Status, int]:
        """Write on; returns the status and the number of bytes that fitted."""
        handle = self._handle(number, Use.WRITE)
        if handle is None or handle.file is None:
            return Status.ILLEGAL_HANDLE, 0
        file = handle.file
        fitting = data[: file.size - len(file.content)]
        file.content += fitting
        if len(fitting) < len(data):
            handle.overrun = True
            return Status.END_OF_FILE_EXPECTED, len(fitting)
        return Status.OK, len(fitting)

    def close(self, number: int) -> Status:
        """Close a handle; a complete download enters the directory, an incomplete one is lost."""
        if number >= HANDLES:
            return Status.OK
        handle = self._handles[number]
        if handle.use == Use.FREE:
            return Status.HANDLE_ALREADY_CLOSED
        if handle.use == Use.WRITE and handle.file is not None:
            self._finish(handle.file, complete=not handle.overrun)
        handle.use, handle.file = Use.FREE, None
        return Status.OK

    def crop(self, number: int) -> Status:
        """Close a data file and free its unused space."""
        handle = self._handle(number, Use.WRITE)
        file = handle.file if handle else None
        status = self.close(number)
        if file is not None and file.appendable:
            self.flash.shrink(file)
            self.free_flash = self.flash.free
        return status

    def delete(self, name: str) -> Status:
        """Delete the first file that matches and is not open."""
        status, _, file = self._find(name)
        if file is None:
            return status
        if self._is_open(file, Use.READ, Use.WRITE):
            return Status.FILE_IS_BUSY
        self.flash.files.remove(file)
        self.flash.release(file)
        self.free_flash = self.flash.free
        return Status.OK

    def find_first(self, pattern: str, *, keep: bool = False) -> tuple[Status, int, File | None]:
        """Start a listing; without a match the handle is free again."""
        status, number = self._allocate(pattern)
        if status:
            return status, 0, None
        handle = self._handles[number]
        handle.matches, handle.found = matcher(pattern), -1
        found = self.find_next(number)
        if found[0] == Status.OK:
            handle.use, handle.keep = Use.SEARCH, keep
        return found

    def find_next(self, number: int) -> tuple[Status, int, File | None]:
        """Continue a listing; the firmware does not check whether it was started."""
        handle = self._handles[number % HANDLES]
        files = self.flash.files
        handle.found = self.flash.find(handle.matches, min(handle.found + 1, len(files)))
        if handle.found == len(files):
            return Status.FILE_NOT_FOUND, 0, None
        return Status.OK, number, files[handle.found]

    def close_all(self) -> None:
        """Close every handle that was opened over USB, as when the cable is pulled."""
        for number, handle in enumerate(self._handles):
            if not handle.keep:
                self.close(number)

    def erase(self) -> None:
        """Delete all files and close all handles."""
        for handle in self._handles:
            handle.use, handle.file = Use.FREE, None
        self.flash.erase()
        self.free_flash = self.flash.free

    def _allocate(self, name: str) -> tuple[Status, int]:
        """The lowest free handle, if `name` is legal; `_take` makes it used."""
        if len(name) > NAME_LIMIT:
            return Status.ILLEGAL_FILE_NAME, 0
        for number, handle in enumerate(self._handles):
            if handle.use == Use.FREE:
                return Status.OK, number
        return Status.NO_MORE_HANDLES, 0

    def _find(self, name: str) -> tuple[Status, int, File | None]:
        """A free handle and the first file that matches; without the file, the status says why."""
        status, number = self._allocate(name)
        file = None if status else self._first(name)
        return status or (Status.OK if file else Status.FILE_NOT_FOUND), number, file

    def _take(self, number: int, use: Use, file: File, *, keep: bool) -> None:
        handle = self._handles[number]
        handle.use, handle.file, handle.position, handle.overrun, handle.keep = use, file, 0, False, keep

    def _handle(self, number: int, use: Use) -> Handle | None:
        handle = self._handles[number] if number < HANDLES else None
        return handle if handle and handle.use == use else None

    def _first(self, name: str) -> File | None:
        files = self.flash.files
        number = self.flash.find(matcher(name))
        return files[number] if number < len(files) else None

    def _is_open(self, file: File, *uses: Use) -> bool:
        return any(handle.file is file and handle.use in uses for handle in self._handles)

    def _downloads(self) -> list[File]:
        written = [handle.file for handle in self._handles if handle.use == Use.WRITE and handle.file]
        return [file for file in written if not file.appendable]

    def _refusal(self, file: File) -> Status:
        downloads = self._downloads()
        matches = matcher(file.name)
        if self._first(file.name) or any(matches(download.name) for download in downloads):
            return Status.FILE_EXISTS
        if len(self.flash.files) + len(downloads) >= self.flash.limit:
            return Status.NO_MORE_FILES
        if sum(handle.use == Use.WRITE for handle in self._handles) >= WRITERS:
            return Status.NO_WRITE_BUFFERS
        return Status.OK

    def _reserve(self, file: File, *, linear: bool) -> Status:
        if file.size > self.flash.free:
            return Status.NO_SPACE
        if not self.flash.reserve(file, contiguous=linear):
            return Status.NO_LINEAR_SPACE if linear else Status.NO_SPACE
        return Status.OK

    def _finish(self, file: File, *, complete: bool) -> None:
        if file.appendable:
            file.data_size = len(file.content)
        elif complete and len(file.content) == file.size:
            file.data_size = file.size
            self.flash.files.insert(0, file)
        else:
            self.flash.release(file)
