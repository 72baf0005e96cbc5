"""The loader module: sixteen handles for files and searches. Source: docs/firmware.md section 5.

The firmware's quirks are kept: a search that was never opened can be continued, opening an empty file closes handle 0
and leaks its own, and handles beyond the table can be "closed".
"""

from __future__ import annotations

from typing import NamedTuple

from firmware_protocol.status import Status
from sim_backend.firmware.files.file_handle import Handle, Use, WriteBuffer
from sim_backend.firmware.files.file_header import File, Kind
from sim_backend.firmware.files.flash import Flash
from sim_backend.firmware.files.names import NAME_LIMIT, fold, looked_for, matcher
from sim_backend.firmware.versions import Version

HANDLES = 16
WRITERS = 4

NOWHERE = 0xFF
"""Index before the first entry: it counts as -1 in an unsigned byte."""

_ADDRESSABLE = 256
"""Handles that a telegram can name; beyond the table FindNext reads memory that is assumed to be zero."""

_LINEAR = (".rxe", ".sys", ".rtm")
"""Files whose names contain one of these become one block: programs are executed in place."""


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
        found_size: Size of the file that `look_up` last looked for, 0 without that file; the firmware writes it to
            address 0.
    """

    def __init__(self, flash: Flash, version: Version) -> None:
        """Make the module.

        Args:
            flash: The flash at power-on.
            version: The firmware version.
        """
        self.flash = flash
        flash.count()
        self.free_flash = flash.free
        self.over_usb = set[int]()
        self.found_size = 0
        self._version = version
        self._addressable = [Handle(flash.memory) for _ in range(_ADDRESSABLE)]
        self.handles = self._addressable[:HANDLES]
        self._buffers = [WriteBuffer() for _ in range(WRITERS)]

    def look_up(self, name: str) -> bool:
        """Look a file up for StartProgram or PlaySoundFile; return whether it exists, False without a free handle.

        As in the firmware, a successful search stays open, and handle 0 is closed instead.
        """
        status, number, file = self._find(name)
        if status in (Status.OK, Status.FILE_NOT_FOUND):
            self.found_size = file.size if file else 0
        if status:
            return False
        self._addressable[number].use = Use.SEARCH
        self.close(0)
        return True

    def open_block(self, name: str) -> tuple[Status, int, File | None]:
        """Open a file for its address, as a program is. A file that is not one block is returned, but not opened.

        The handle gets no place to read from.
        """
        status, number, file = self._find(name)
        if file is not None:
            self._addressable[number].use = Use.READ
            if not file.kind & Kind.LINEAR:
                self.close(number)
                return Status.NOT_A_LINEAR_FILE, number, file
        return status, number, file

    def open_read(self, name: str) -> Opened:
        """Open the first file that matches."""
        status, number, file = self._find(name)
        if file is None:
            return Opened(status, number)
        handle = self._addressable[number]
        handle.use = Use.READ
        if not file.size:  # the firmware leaks the handle
            self.close(0)
            return Opened(Status.FILE_NOT_FOUND, 0)
        handle.begin_reading(file)
        return Opened(Status.OK, number, file.data_size)

    def create(self, name: str, size: int, *, linear: bool = False, appendable: bool = False) -> Opened:
        """Create a file open for writing; it enters the directory at once or when closed complete."""
        status, number, _ = self._find(name)
        if status != Status.FILE_NOT_FOUND:
            return Opened(status or Status.FILE_EXISTS, number)
        if status := self._refusal(name):
            return Opened(status, number)
        block = linear or (appendable and self._version.linear_data_files)
        kind = (Kind.DATA if appendable else Kind.SYSTEM) | (Kind.LINEAR if block else Kind.SCATTERED)
        if size > self.flash.free:
            return Opened(Status.NO_SPACE, number)
        new = self.flash.sectors.allocate(name, size, kind)
        if new is None:
            return Opened(Status.NO_LINEAR_SPACE if block else Status.UNDEFINED_ERROR, number)
        self._addressable[number].begin_writing(new, self._free_buffer())
        self._count_written(number, 0)
        if appendable:
            self._enter(number)
        self.free_flash = self.flash.free
        return Opened(Status.OK, number)

    def create_by_telegram(self, name: str, size: int, *, appendable: bool = False) -> Opened:
        """Create a file as a telegram does: its name decides whether it is one block."""
        block = any(part in name.lower()[self._version.ignores_leading_extension :] for part in _LINEAR)
        if appendable and block and self._version.strict_data_names:
            return Opened(Status.ILLEGAL_FILE_NAME, 0)
        return self.create(name, size, linear=block and not appendable, appendable=appendable)

    def replace(self, name: str, content: bytes) -> bool:
        """Store a file in place of one of that name, as the user interface does; return whether there is room."""
        self.delete(name)
        status, number, _ = self.create(name, len(content))
        if not status:
            self.write(number, content)
            self.close(number)
        return not status

    def append(self, name: str) -> Opened:
        """Open a data file to append; `Opened.size` is the space left."""
        status, number, file = self._find(name)
        if file is None:
            return Opened(status, number)
        if self._is_being_written(name):
            return Opened(Status.FILE_IS_BUSY, number)
        if not file.kind & Kind.DATA:
            return Opened(Status.APPEND_NOT_POSSIBLE, number)
        if file.data_size >= file.size:
            return Opened(Status.FILE_IS_FULL, number)
        if all(buffer.taken for buffer in self._buffers):
            return Opened(Status.NO_WRITE_BUFFERS, number)
        self._addressable[number].begin_appending(file, self._free_buffer())
        self._count_written(number, file.data_size)
        return Opened(Status.OK, number, file.size - file.data_size)

    def _count_written(self, number: int, size: int) -> None:
        """Count the bytes of a file that is opened for writing as read; in other versions the last count stays."""
        if self._version.counts_written:
            self._addressable[number].position = size

    def read(self, number: int, size: int) -> tuple[Status, bytes]:
        """Read on; return fewer bytes at the end of the file."""
        handle = self._handle(number, Use.READ)
        if handle is None:
            return Status.ILLEGAL_HANDLE, b""
        data = handle.read(size)
        return (Status.OK if len(data) == size else Status.END_OF_FILE), data

    def write(self, number: int, data: bytes) -> tuple[Status, int]:
        """Write on; return the status and the number of bytes that fitted."""
        handle = self._handle(number, Use.WRITE)
        if handle is None:
            return Status(Status.ILLEGAL_HANDLE | self._first_writer_status), 0
        written = handle.write(data)
        return (Status.END_OF_FILE_EXPECTED if handle.buffer.overrun else Status.OK), written

    def close(self, number: int) -> Status:
        """Close a handle; a complete download enters the directory, an incomplete one is lost."""
        if number >= HANDLES:
            return Status.OK
        handle = self._addressable[number]
        if handle.use == Use.FREE:
            return Status.HANDLE_ALREADY_CLOSED
        if handle.use == Use.WRITE:
            if handle.end_writing():
                self._enter(number)
            elif not handle.kind & Kind.DATA:
                self.flash.count()
        handle.use = Use.FREE
        return Status.OK

    def crop(self, number: int) -> Status:
        """Close any handle, and free the unused space of the data file that its index refers to.

        A download enters the directory then, which moves that file: the changed header becomes that of the download.
        """
        handle = self._addressable[number]
        index = handle.index
        status = self.close(number)
        if not status and index < len(self.flash.directory):
            file = self.flash.file(index)
            if file.size != file.data_size:
                file.resize(file.data_size, self.flash.directory[handle.index])
                self.flash.count()
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
        del self.flash.directory[found.index]
        self.flash.count()
        if self._version.deletion_spares_found:
            self._shift(found.index + 1, -1)
        else:
            for handle in self.handles:  # this changes the index of the deletion's own handle
                if (handle is found or handle.use != Use.FREE) and handle.index >= found.index:
                    handle.index = (handle.index - 1) & 0xFF
        return Status.OK

    def _blocked(self, number: int) -> bool:
        """Return whether a handle that is in use refers to the directory entry that a search found."""
        uses = {Use.READ} | ({Use.WRITE} if self._version.writing_prevents_deletion else set())
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
            file.rename(new_name)
        return Opened(status, number)

    def find_first(self, pattern: str) -> tuple[Status, int, File | None]:
        """Start a listing; without a match the handle is free again."""
        found = self._find(pattern)
        if not found[0]:
            self._addressable[found[1]].use = Use.SEARCH
        return found

    def find_next(self, number: int) -> tuple[Status, int, File | None]:
        """Continue the last look-up with a handle; the firmware does not check what the handle is used for."""
        handle, flash = self._addressable[number], self.flash
        index = flash.find(handle.matches, (handle.index + 1) & 0xFF)
        if index >= len(flash.directory):
            return Status.FILE_NOT_FOUND, number, None
        handle.index = index
        return Status.OK, number, flash.file(index)

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

    def erase(self) -> None:
        """Delete all files and close all handles."""
        for handle in self.handles:
            handle.use, handle.buffer.taken = Use.FREE, False
        self.flash.erase()
        self.free_flash = self.flash.free

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
        handle.name, handle.matches, handle.index = looked_for(name), matcher(name), NOWHERE
        return self.find_next(number)

    @property
    def _first_writer_status(self) -> int:
        """Bits from the file in the first write buffer, added to the status of a Write by a handle not for writing."""
        first = self._buffers[0]
        return Status.END_OF_FILE_EXPECTED if first.taken and first.overrun else Status.OK

    def opened(self, number: int) -> Handle | None:
        """Return a handle that reads or writes."""
        return self._handle(number, Use.READ) or self._handle(number, Use.WRITE)

    def _free_buffer(self) -> WriteBuffer:
        return next(buffer for buffer in self._buffers if not buffer.taken)

    def _handle(self, number: int, use: Use) -> Handle | None:
        handle = self._addressable[number] if number < HANDLES else None
        return handle if handle and handle.use == use else None

    def _is_being_written(self, name: str) -> bool:
        """Return whether a file is being written for whose name or pattern the firmware looked for this name."""
        return any(handle.use == Use.WRITE and handle.name == fold(name) for handle in self.handles)

    def _refusal(self, name: str) -> Status:
        writers = sum(buffer.taken for buffer in self._buffers)  # data files, which have entries already, count twice
        pattern = "*." in name or ".*" in name
        if not pattern and self._is_being_written(name):
            return Status.FILE_EXISTS
        if len(self.flash.directory) + writers >= self.flash.limit:
            return Status.NO_MORE_FILES
        if writers >= WRITERS:
            return Status.NO_WRITE_BUFFERS
        return Status.OK

    def _enter(self, number: int) -> None:
        """Make the file that a handle writes the first of the directory."""
        handle = self._addressable[number]
        self.flash.directory.insert(0, handle.header)
        self._shift(0, 1)
        handle.index = 0

    def _shift(self, start: int, step: int) -> None:
        """Adjust the indexes of used handles from `start` on to an inserted or deleted entry."""
        for handle in self.handles:
            if handle.use != Use.FREE and handle.index >= start:
                handle.index = (handle.index + step) & 0xFF
