"""What the commands for files do. Source: docs/firmware.md section 5 (0x80 to 0x8D, 0xA0)."""

from __future__ import annotations

from firmware_protocol.status import Status
from firmware_protocol.system import (
    AppendOpened,
    Close,
    CropDataFile,
    Delete,
    DeleteUserFlash,
    FileData,
    FileFound,
    FileHandle,
    FileOpened,
    FileWritten,
    FindFirst,
    FindNext,
    OpenAppendData,
    OpenRead,
    OpenWrite,
    OpenWriteData,
    OpenWriteLinear,
    Read,
    Write,
)
from sim_backend.firmware.answer import DONE, Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.flash import File
from sim_backend.firmware.limits import Channel
from sim_backend.firmware.loader import Loader, Opened

_FIRST_PIECE, _NEXT_PIECE = 120, 126
"""Data bytes of the pieces in which a long Read over Bluetooth is sent; at the end of the file the rest is not sent."""

_NAME_SIZE = 20


class FileHandlers:
    """Creating, reading, listing and deleting files."""

    def __init__(self, loader: Loader, channel: Channel) -> None:
        self._loader, self._channel = loader, channel

    @property
    def _keep(self) -> bool:
        """Whether what is opened now outlives the USB cable."""
        return self._channel.limits.streams

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            OpenRead: self.open_read,
            OpenWrite: self.open_write,
            OpenWriteLinear: self.open_write_linear,
            OpenWriteData: self.open_write_data,
            OpenAppendData: self.open_append_data,
            Read: self.read,
            Write: self.write,
            Close: self.close,
            CropDataFile: self.crop,
            Delete: self.delete,
            FindFirst: self.find_first,
            FindNext: self.find_next,
            DeleteUserFlash: self.delete_user_flash,
        }

    def open_read(self, command: OpenRead) -> Answer:
        """Open for reading."""
        status, handle, size = self._loader.open_read(command.name, keep=self._keep)
        return answer(FileOpened(handle, size), status)

    def open_write(self, command: OpenWrite) -> Answer:
        """Start a download."""
        return _opened(self._loader.create(command.name, command.size, keep=self._keep))

    def open_write_linear(self, command: OpenWriteLinear) -> Answer:
        """Start a download into one block."""
        return _opened(self._loader.create(command.name, command.size, linear=True, keep=self._keep))

    def open_write_data(self, command: OpenWriteData) -> Answer:
        """Create a data file."""
        return _opened(self._loader.create(command.name, command.size, appendable=True, keep=self._keep))

    def open_append_data(self, command: OpenAppendData) -> Answer:
        """Open a data file at its end."""
        status, handle, remaining = self._loader.append(command.name, keep=self._keep)
        return answer(AppendOpened(handle, remaining), status)

    def read(self, command: Read) -> Answer:
        """Read on; the length in the reply is the one asked for, what is missing is zero."""
        limits = self._channel.limits
        if limits.streams and command.size > limits.read:
            return self._read_long(command)
        size = min(command.size, limits.read)
        status, data = self._loader.read(command.handle, size)
        return answer(FileData(command.handle, command.size, data.ljust(size, b"\0")), status)

    def _read_long(self, command: Read) -> Answer:
        status, data, piece = Status.OK, b"", _FIRST_PIECE
        while not status and len(data) < command.size:
            piece = min(piece, command.size - len(data))
            status, part = self._loader.read(command.handle, piece)
            data += part.ljust(piece, b"\0")
            piece = _NEXT_PIECE
        return answer(FileData(command.handle, command.size, data), status)

    def write(self, command: Write) -> Answer:
        """Write on."""
        status, written = self._loader.write(command.handle, command.data)
        return answer(FileWritten(command.handle, written), status)

    def close(self, command: Close) -> Answer:
        """Close a file or a search."""
        return answer(FileHandle(command.handle), self._loader.close(command.handle))

    def crop(self, command: CropDataFile) -> Answer:
        """Close a data file and shrink it to its data."""
        return answer(FileHandle(command.handle), self._loader.crop(command.handle))

    def delete(self, command: Delete) -> Answer:
        """Delete the first file that matches; the name comes back in any case."""
        status = self._loader.delete(command.name)
        return Answer(status, command.name.encode("latin-1").ljust(_NAME_SIZE, b"\0"))

    def find_first(self, command: FindFirst) -> Answer:
        """Start a listing."""
        return _found(*self._loader.find_first(command.pattern, keep=self._keep))

    def find_next(self, command: FindNext) -> Answer:
        """Continue a listing."""
        return _found(*self._loader.find_next(command.handle))

    def delete_user_flash(self, _: DeleteUserFlash) -> Answer:
        """Delete everything."""
        self._loader.erase()
        return DONE


def _opened(opened: Opened) -> Answer:
    return answer(FileHandle(opened.handle), opened.status)


def _found(status: Status, handle: int, file: File | None) -> Answer:
    if file is None:
        return refuse_with_zeros(FindFirst, status)
    return answer(FileFound(handle, file.name, file.size))
