"""The loader module: sixteen handles for files and searches. Source: docs/firmware.md section 5.

The firmware's quirks are kept: a search that was never opened can be continued, opening an empty file closes handle 0
and leaks its own, and handles beyond the table can be "closed".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from firmware_protocol.status import Status
from sim_backend.firmware.files.file_handle import Handle, Use
from sim_backend.firmware.files.flash import SETTINGS, File, Flash
from sim_backend.firmware.files.names import NAME_LIMIT, fold, looked_for, matcher
from sim_backend.firmware.versions import Version

HANDLES = 16
WRITERS = 4

_NOWHERE = 0xFF
"""Index before the first entry: it counts as -1 in an unsigned byte."""

_ADDRESSABLE = 256
"""Handles that a telegram can name; beyond the table FindNext reads memory that is assumed to be zero."""

_LINEAR = (".rxe", ".sys", ".rtm")
"""Files whose names contain one of these are contiguous: programs are executed in place."""


class Opened(NamedTuple):
    """Result of opening a file; the handle's number is reported even if it was refused and is free again."""

    status: Status
    handle: int
    size: int = 0


class Loader:
    """The file system.

    Attributes:
        flash: The files.
        handles: The handles by their numbers.
        free_flash: Free bytes at the last change; closing a file does not refresh it.
        over_usb: Numbers of the handles that were opened over USB and not closed by a telegram.
        on_erase: Called when all files are erased.
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
        self.over_usb = set[int]()
        self.on_erase: Callable[[], None] = lambda: None
        self._version = version
        self._addressable = [Handle() for _ in range(_ADDRESSABLE)]
        self.handles = self._addressable[:HANDLES]
        self._find(SETTINGS)

    def exists(self, name: str) -> bool:
        """Return whether a file exists; False without a free handle for the search.

        As in the firmware, a successful search stays open, and handle 0 is closed instead.
        """
        status, number, _ = self._find(name)
        if status:
            return False
        self._addressable[number].use = Use.SEARCH
        self.close(0)
        return True

    def open_program(self, name: str) -> tuple[int | None, bytes]:
        """Open a program to execute it: its handle and its content; None if it fails."""
        status, number, _ = self.open_read(name, use=Use.EXECUTE)
        file = self._addressable[number].file
        if status or file is None:
            return None, b""
        return number, bytes(file.content)

    def address_of(self, number: int | None) -> int:
        """Return where the content of the file of a handle begins in the processor's memory."""
        file = None if number is None else self._addressable[number].file
        return self._version.flash_start + (file.content_at if file else 0)

    def linear_content(self, name: str) -> tuple[Status, bytes]:
        """Return the content of a file that was created as one block, if it can be opened."""
        status, number, _ = self.open_read(name)
        file = self._addressable[number].file
        if status or file is None:
            return status, b""
        self.close(number)
        return (Status.OK, bytes(file.content)) if file.linear else (Status.NOT_A_LINEAR_FILE, b"")

    def open_read(self, name: str, *, use: Use = Use.READ) -> Opened:
        """Open the first file that matches."""
        status, number, file = self._find(name)
        if file is None:
            return Opened(status, number)
        if not file.size:
            self._addressable[number].use = Use.READ  # the firmware leaks it
            self.close(0)
            return Opened(Status.FILE_NOT_FOUND, 0)
        self._take(number, use, file)
        return Opened(Status.OK, number, file.data_size)

    def create(self, name: str, size: int, *, linear: bool = False, appendable: bool = False) -> Opened:
        """Create a file open for writing; it enters the directory at once or when closed complete."""
        program = any(part in name.lower() for part in _LINEAR)
        status, number, _ = self._find(name)
        if status != Status.FILE_NOT_FOUND:
            return Opened(status or Status.FILE_EXISTS, number)
        file = File(name, size, appendable, linear or (program and not appendable), data_size=0 if appendable else size)
        status = self._refusal(file)
        if not status:
            status = self._reserve(file)
        if status:
            return Opened(status, number)
        self._take(number, Use.WRITE, file)
        self._write_header(file)
        if appendable:
            self._enter(number, file)
        self.free_flash = self.flash.free
        return Opened(Status.OK, number)

    def create_data(self, name: str, size: int) -> Opened:
        """Create a data file as a telegram does, which checks the name; programs may take any."""
        if self._version.strict_data_names and any(part in name.lower() for part in _LINEAR):
            return Opened(Status.ILLEGAL_FILE_NAME, 0)
        return self.create(name, size, appendable=True)

    def append(self, name: str) -> Opened:
        """Open a data file to append; `Opened.size` is the space left."""
        status, number, file = self._find(name)
        if file is None:
            return Opened(status, number)
        if self._is_being_written(name):
            return Opened(Status.FILE_IS_BUSY, number)
        if not file.appendable:
            return Opened(Status.APPEND_NOT_POSSIBLE, number)
        if file.data_size >= file.size:
            return Opened(Status.FILE_IS_FULL, number)
        if len(self._writers) >= WRITERS:
            return Opened(Status.NO_WRITE_BUFFERS, number)
        self._take(number, Use.WRITE, file)
        return Opened(Status.OK, number, file.size - file.data_size)

    def read(self, number: int, size: int) -> tuple[Status, bytes]:
        """Read on; return fewer bytes at the end of the file."""
        handle = self._handle(number, Use.READ) or self._handle(number, Use.EXECUTE)
        if handle is None:
            return Status.ILLEGAL_HANDLE, b""
        data = handle.read(size)
        return (Status.OK if len(data) == size else Status.END_OF_FILE), data

    def write(self, number: int, data: bytes) -> tuple[Status, int]:
        """Write on; return the status and the number of bytes that fitted."""
        handle = self._handle(number, Use.WRITE)
        if handle is None or handle.file is None:
            return Status(Status.ILLEGAL_HANDLE | self._first_writer_status), 0
        file = handle.file
        if handle.overrun:
            return Status.END_OF_FILE_EXPECTED, 0
        fitting = data[: file.announced - len(file.content)]
        buffered = len(file.content)
        file.content += fitting
        if buffered < file.first_page <= len(file.content):
            self._write_header(file)
        if len(fitting) < len(data):
            handle.overrun = True
            return Status.END_OF_FILE_EXPECTED, len(fitting)
        return Status.OK, len(fitting)

    def close(self, number: int) -> Status:
        """Close a handle; a complete download enters the directory, an incomplete one is lost."""
        if number >= HANDLES:
            return Status.OK
        handle = self._addressable[number]
        if handle.use == Use.FREE:
            return Status.HANDLE_ALREADY_CLOSED
        if handle.use == Use.WRITE and handle.file is not None:
            handle.leave_written(handle.file)
            self._finish(number, handle.file, complete=not handle.overrun)
        handle.use, handle.file = Use.FREE, None
        return Status.OK

    def crop(self, number: int) -> Status:
        """Close any handle, and free the unused space of the data file that its index refers to."""
        index = self._addressable[number].index if number < HANDLES else 0
        status = self.close(number)
        if not status and index < len(self.flash.files):
            self.flash.shrink(self.flash.files[index])
        self.free_flash = self.flash.free
        return status

    def delete(self, name: str) -> Status:
        """Delete the first file that matches, unless a handle in use refers to its directory entry.

        A download has no entry yet, but its handle has the index of its failed look-up, which later files have shifted.
        """
        status, number, file = self._find(name)
        if file is not None:
            status = self._remove(number)
        self.free_flash = self.flash.free
        return status

    def _remove(self, number: int) -> Status:
        if self._blocked(number):
            return Status.FILE_IS_BUSY
        found = self._addressable[number]
        del self.flash.files[found.index]
        self.flash.count()
        if self._version.deletion_spares_found:
            self._shift(found.index + 1, -1)
        else:
            for handle in self.handles:  # the index of the deletion's own changes on the way
                if (handle is found or handle.use != Use.FREE) and handle.index >= found.index:
                    handle.index = (handle.index - 1) & 0xFF
        return Status.OK

    def _blocked(self, number: int) -> bool:
        """Return whether a handle that is in use refers to the directory entry that a search found."""
        uses = {Use.READ, Use.EXECUTE} | ({Use.WRITE} if self._version.writing_prevents_deletion else set())
        index = self._addressable[number].index
        return any(handle.use in uses and handle.index == index for handle in self.handles)

    def rename(self, name: str, new_name: str) -> Opened:
        """Rename a file, unless a handle in use refers to its directory entry; the handle is the search's."""
        status, number, _ = self._find(new_name)
        if status != Status.FILE_NOT_FOUND:
            self.close(number)  # also if it belongs to another file, since none is free
            return Opened(status or Status.FILE_EXISTS, number)
        status, number, file = self._find(name)
        if file is not None:
            if self._blocked(number):
                return Opened(Status.FILE_IS_BUSY, number)
            file.name = new_name
        return Opened(status, number)

    def is_there(self, name: str) -> bool:
        """Return whether a file matches."""
        return self.flash.find(matcher(name)) < len(self.flash.files)

    def find_first(self, pattern: str) -> tuple[Status, int, File | None]:
        """Start a listing; without a match the handle is free again."""
        found = self._find(pattern)
        if not found[0]:
            self._addressable[found[1]].use = Use.SEARCH
        return found

    def find_next(self, number: int) -> tuple[Status, int, File | None]:
        """Continue the last look-up with a handle; the firmware does not check what the handle is used for."""
        handle, files = self._addressable[number], self.flash.files
        index = self.flash.find(handle.matches, (handle.index + 1) & 0xFF)
        if index >= len(files):
            return Status.FILE_NOT_FOUND, number, None
        handle.index = index
        return Status.OK, number, files[index]

    def list_all(self, pattern: str) -> File | None:
        """Go through a listing and close its handle, or handle 0 without a free one; return its first file, if any."""
        status, number, first = self.find_first(pattern)
        while not status:
            status, *_ = self.find_next(number)
        self.close(number)
        return first

    def close_all(self) -> None:
        """Close every handle that was opened over USB, as when the cable is pulled."""
        for number in sorted(self.over_usb):
            self.close(number)
        self.over_usb.clear()

    def restore_settings(self) -> bytes:
        """Return the settings; their file is created if there is no valid one."""
        settings = self.flash.restore_settings()
        self.free_flash = self.flash.free
        return settings

    def erase(self) -> None:
        """Delete all files and close all handles."""
        for handle in self.handles:
            handle.use, handle.file = Use.FREE, None
        self.flash.erase()
        self.free_flash = self.flash.free
        self.on_erase()

    @property
    def next_handle(self) -> int:
        """The lowest free handle, 0 if there is none."""
        return next((number for number, handle in enumerate(self.handles) if handle.use == Use.FREE), 0)

    def _find(self, name: str) -> tuple[Status, int, File | None]:
        """Return a free handle and the first file that matches; without the file, the status says why."""
        number = self.next_handle
        handle = self._addressable[number]
        if handle.use != Use.FREE:
            return Status.NO_MORE_HANDLES, number, None
        if len(name) > NAME_LIMIT:
            return Status.ILLEGAL_FILE_NAME, number, None
        handle.name, handle.matches, handle.index = looked_for(name), matcher(name), _NOWHERE
        return self.find_next(number)

    @property
    def _writers(self) -> dict[int, Handle]:
        """The handles that write, by their write buffer."""
        return {handle.slot: handle for handle in self.handles if handle.use == Use.WRITE}

    @property
    def _first_writer_status(self) -> int:
        """What the file in the first write buffer adds to the status of a Write by a handle that does not write."""
        first = self._writers.get(0)
        return Status.END_OF_FILE_EXPECTED if first and first.overrun else Status.OK

    def _take(self, number: int, use: Use, file: File) -> None:
        handle = self._addressable[number]
        if use == Use.WRITE:
            handle.slot = min(set(range(HANDLES)) - set(self._writers))
        handle.open(use, file)

    def _handle(self, number: int, use: Use) -> Handle | None:
        handle = self._addressable[number] if number < HANDLES else None
        return handle if handle and handle.use == use else None

    def _is_being_written(self, name: str) -> bool:
        """Return whether a file is being written for whose name or pattern the firmware looked for this name."""
        return any(handle.use == Use.WRITE and handle.name == fold(name) for handle in self.handles)

    def _downloads(self) -> list[File]:
        written = [handle.file for handle in self.handles if handle.use == Use.WRITE and handle.file]
        return [file for file in written if not file.appendable]

    def _refusal(self, file: File) -> Status:
        writers = len(self._writers)  # data files, which are in the directory already, count twice
        pattern = "*." in file.name or ".*" in file.name
        if not pattern and self._is_being_written(file.name):
            return Status.FILE_EXISTS
        if len(self.flash.files) + writers >= self.flash.limit:
            return Status.NO_MORE_FILES
        if writers >= WRITERS:
            return Status.NO_WRITE_BUFFERS
        return Status.OK

    def _reserve(self, file: File) -> Status:
        if file.size > self.flash.free:
            return Status.NO_SPACE
        contiguous = file.linear or (file.appendable and self._version.linear_data_files)
        if self.flash.reserve(file, contiguous=contiguous):
            return Status.OK
        return Status.NO_LINEAR_SPACE if contiguous else Status.UNDEFINED_ERROR

    def _enter(self, number: int, file: File) -> None:
        """Make a file the first of the directory."""
        self.flash.files.insert(0, file.seen)
        self._shift(0, 1)
        self._addressable[number].index = 0

    def _write_header(self, file: File) -> None:
        """Write a header to the flash, over that of another file whose sectors were freed while it was open."""
        file.renew_header()
        for other in self._downloads():
            if other is not file and other.sectors[:1] == file.sectors[:1]:
                other.overlaid_by = file
        entries = self.flash.files
        entries[:] = [file if each.sectors[:1] == file.sectors[:1] else each for each in entries]

    def _shift(self, start: int, step: int) -> None:
        """Adjust the indexes of used handles from `start` on to an inserted or deleted entry."""
        for handle in self.handles:
            if handle.use != Use.FREE and handle.index >= start:
                handle.index = (handle.index + step) & 0xFF

    def _finish(self, number: int, file: File, *, complete: bool) -> None:
        if file.appendable:
            file.data_size = len(file.content)
            if file.data_size < file.first_page:
                self._write_header(file)
        elif complete and len(file.content) == file.size:
            self._enter(number, file)
        else:
            self.flash.count()
