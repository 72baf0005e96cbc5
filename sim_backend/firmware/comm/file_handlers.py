"""Handlers of the commands for files. Source: docs/firmware.md section 5 (0x80 to 0x8D, 0xA0)."""

from __future__ import annotations

from firmware_protocol import enhanced, system
from firmware_protocol.status import Status
from sim_backend.firmware.comm.handler_result import DONE, HandlerResult, handles, reply_with
from sim_backend.firmware.command_link import CommandLink
from sim_backend.firmware.files.file_header import File
from sim_backend.firmware.files.loader import Loader, Opened
from sim_backend.firmware.files.names import pack_name


class FileHandlers:
    """Creating, reading, listing and deleting files."""

    def __init__(self, loader: Loader, link: CommandLink) -> None:
        self._loader, self._link = loader, link

    @property
    def _over_usb(self) -> bool:
        return not self._link.limits.streams

    def _noted(self, opened: Opened) -> Opened:
        """Record a handle that was opened over USB: pulling the cable closes it, whatever it belongs to by then."""
        if self._over_usb and not opened.status:
            self._loader.over_usb.add(opened.handle)
        return opened

    @handles(system.OpenRead)
    def open_read(self, command: system.OpenRead) -> HandlerResult:
        """Open for reading."""
        status, handle, size = self._noted(self._loader.open_read(command.name))
        return reply_with(system.FileOpened(handle, size), status)

    @handles(system.OpenWrite)
    def open_write(self, command: system.OpenWrite) -> HandlerResult:
        """Start a download."""
        return _opened(self._noted(self._loader.create_by_telegram(command.name, command.size)))

    @handles(system.OpenWriteLinear)
    def open_write_linear(self, command: system.OpenWriteLinear) -> HandlerResult:
        """Start a download into one block."""
        return _opened(self._noted(self._loader.create(command.name, command.size, linear=True)))

    @handles(system.OpenWriteData)
    def open_write_data(self, command: system.OpenWriteData) -> HandlerResult:
        """Create a data file."""
        return _opened(self._noted(self._loader.create_by_telegram(command.name, command.size, appendable=True)))

    @handles(system.OpenAppendData)
    def open_append_data(self, command: system.OpenAppendData) -> HandlerResult:
        """Open a data file at its end."""
        status, handle, remaining = self._noted(self._loader.append(command.name))
        return reply_with(system.AppendOpened(handle, remaining), status)

    @handles(system.Read)
    def read(self, command: system.Read) -> HandlerResult:
        """Read on; the reply has the requested length, padded with zeros."""
        limits = self._link.limits
        if limits.streams and command.size > limits.read:
            return HandlerResult(sent=self._link.long_read.begin(command.handle, command.size))
        size = min(command.size, limits.read)
        status, data = self._loader.read(command.handle, size)
        if status == Status.ILLEGAL_HANDLE:
            return reply_with(system.FileData(command.handle, command.size, b""), status)._replace(stale=size)
        return reply_with(system.FileData(command.handle, command.size, data.ljust(size, b"\0")), status)

    @handles(system.Write)
    def write(self, command: system.Write) -> HandlerResult:
        """Write on."""
        status, written = self._loader.write(command.handle, command.data)
        return reply_with(system.FileWritten(command.handle, written), status)

    @handles(system.Close)
    def close(self, command: system.Close) -> HandlerResult:
        """Close a file or a search."""
        if self._over_usb:
            self._loader.over_usb.discard(command.handle)
        return reply_with(system.FileHandle(command.handle), self._loader.close(command.handle))

    @handles(system.CropDataFile)
    def crop(self, command: system.CropDataFile) -> HandlerResult:
        """Close a data file and shrink it to its data."""
        return reply_with(system.FileHandle(command.handle), self._loader.crop(command.handle))

    @handles(system.Delete)
    def delete(self, command: system.Delete) -> HandlerResult:
        """Delete the first file that matches; the reply has the name in any case."""
        status = self._loader.delete(command.name)
        return HandlerResult(status, pack_name(command.name))

    @handles(system.FindFirst)
    def find_first(self, command: system.FindFirst) -> HandlerResult:
        """Start a listing."""
        found = self._loader.find_first(command.pattern)
        self._noted(Opened(*found[:2]))
        return _found(*found)

    @handles(system.FindNext)
    def find_next(self, command: system.FindNext) -> HandlerResult:
        """Continue a listing."""
        return _found(*self._loader.find_next(command.handle))

    @handles(enhanced.RenameFile)
    def rename(self, command: enhanced.RenameFile) -> HandlerResult:
        """Rename a file; the reply has both names in any case."""
        status, handle, _ = self._loader.rename(command.name, command.new_name)
        return HandlerResult(status, bytes([handle]) + pack_name(command.name) + pack_name(command.new_name))

    @handles(system.DeleteUserFlash)
    def delete_user_flash(self, _: system.DeleteUserFlash) -> HandlerResult:
        """Delete all files."""
        self._loader.erase()
        return DONE


def _opened(opened: Opened) -> HandlerResult:
    return reply_with(system.FileHandle(opened.handle), opened.status)


def _found(status: Status, handle: int, file: File | None) -> HandlerResult:
    if file is None:
        return reply_with(system.FileFound(handle, "", 0), status)
    # packed here, as data in place of a header may be a name without an end
    return HandlerResult(payload=bytes([handle]) + pack_name(file.name) + file.size.to_bytes(4, "little"))
