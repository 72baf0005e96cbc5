"""Handlers of the commands for modules and their IO maps. Source: docs/firmware.md section 5 (0x90 to 0x95)."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from firmware_protocol import system
from firmware_protocol.iomap import COMM
from firmware_protocol.iomap_layout import IOMap
from firmware_protocol.status import Status
from sim_backend.firmware.comm.handler_result import HandlerResult, handles, refuse_with_zeros, reply_with
from sim_backend.firmware.command_link import CommandLink
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import unpack_name
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.module_search import ModuleSearch

_HANDLE = 0

_NO_MODULE = LiveMap(IOMap("", 0, 0, {}))
"""Unused entries of the firmware's table of modules, at address 0: the word there is their id, their map is empty."""

_PATTERN = 2
"""Where the pattern of FindFirstModule begins in the receive buffer."""

_ID_AND_OFFSET = slice(3, 9)
"""Bytes of the send buffer that IOMapRead prepares first; the size replaces the offset in the end."""

_ID = slice(3, 7)
"""Bytes of the send buffer that IOMapWrite prepares first."""

_WRITE_OFFSET, _WRITE_SIZE, _WRITE_DATA = slice(6, 8), slice(8, 10), 10
"""Bytes of the receive buffer with the arguments of IOMapWrite."""

_REPLY_DATA = {streams: COMM.field(name).offset + 9 for streams, name in ((False, "UsbOutBuf"), (True, "BtOutBuf"))}
"""Offset in the Comm map of the data of a reply to IOMapRead, over USB and over Bluetooth."""


class ModuleHandlers:
    """Listing of modules, and access to their variables."""

    def __init__(self, maps: Sequence[LiveMap], search: ModuleSearch, loader: Loader, link: CommandLink) -> None:
        self._search, self._loader, self._link = search, loader, link
        self._by_id = {live.layout.module_id: live for live in maps}

    @handles(system.FindFirstModule)
    def find_first(self, _: system.FindFirstModule) -> HandlerResult:
        """Start the listing; there can be only one. The pattern ends with the first zero of the receive buffer."""
        return self._reply(self._search.first(unpack_name(bytes(self._link.inbox[_PATTERN:]))))

    @handles(system.FindNextModule)
    def find_next(self, _: system.FindNextModule) -> HandlerResult:
        """Continue the listing, also one that was closed, or from power-on the one of all modules."""
        return self._reply(self._search.following())

    @handles(system.CloseModuleHandle)
    def close(self, _: system.CloseModuleHandle) -> HandlerResult:
        """Allow the next listing."""
        self._search.close()
        return reply_with(system.ModuleHandle(_HANDLE))

    def _reply(self, found: LiveMap | Status) -> HandlerResult:
        if isinstance(found, Status):
            return refuse_with_zeros(system.FindFirstModule, found)
        return reply_with(system.ModuleFound(_HANDLE, found.layout.name, found.layout.module_id, 0, found.size))

    @handles(system.IOMapRead)
    def read(self, command: system.IOMapRead) -> HandlerResult:
        """Read variables; the length is capped before the range is checked."""
        size = min(command.size, self._link.limits.io_map_read)
        live, status = self._locate(command.module_id, command.offset, size)
        if live is None:
            return reply_with(system.IOMapData(command.module_id, 0, bytes(size)), status)
        return reply_with(system.IOMapData(command.module_id, size, self._copy(live, command, size)))

    def _copy(self, live: LiveMap, command: system.IOMapRead, size: int) -> bytes:
        """Copy variables into the send buffer, byte by byte: a copy of that buffer itself repeats the written bytes."""
        offset = command.offset
        self._link.outbox[_ID_AND_OFFSET] = struct.pack("<IH", command.module_id, offset)
        data = live.read(offset, size)
        written = _REPLY_DATA[self._link.limits.streams] - offset
        if live.layout is COMM and 0 < written < size:
            data = (data[:written] * (size // written + 1))[:size]
        return data

    @handles(system.IOMapWrite)
    def write(self, command: system.IOMapWrite) -> HandlerResult:
        """Write variables; the size is not compared with that of the telegram, and is lost from the receive buffer."""
        inbox, size = self._link.inbox, command.size
        inbox[_WRITE_SIZE] = inbox[_WRITE_OFFSET]
        live, status = self._locate(command.module_id, command.offset, size)
        if live is None:
            return reply_with(system.IOMapWritten(command.module_id, 0), status)
        outbox = self._link.outbox
        outbox[_ID] = struct.pack("<I", command.module_id)
        step = 1 if live.layout is COMM else max(size, 1)  # byte by byte, as its buffers may overlap
        for at in range(0, size, step):
            live.store(command.offset + at, bytes(inbox[_WRITE_DATA + at :][:step]).ljust(step, b"\0"))
        if size and not (live.layout is COMM and self._link.limits.streams):
            live.settle()  # the second byte of the Bluetooth buffer is cleared after the telegram in it, not before
        module_id = int.from_bytes(outbox[_ID], "little")  # the written bytes may have overwritten it
        return reply_with(system.IOMapWritten(module_id, size))

    def _locate(self, module_id: int, offset: int, size: int) -> tuple[LiveMap | None, Status]:
        live = self._by_id.get(module_id, _NO_MODULE if module_id == self._loader.found_size else None)
        if live is None:
            return None, Status.MODULE_NOT_FOUND
        if offset + size > live.size:
            return None, Status.OUT_OF_BOUNDARY
        return live, Status.OK
