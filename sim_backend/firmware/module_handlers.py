"""What the commands for modules and their IO maps do. Source: docs/firmware.md section 5 (0x90 to 0x95)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from firmware_protocol.status import Status
from firmware_protocol.system import (
    CloseModuleHandle,
    FindFirstModule,
    FindNextModule,
    IOMapData,
    IOMapRead,
    IOMapWrite,
    IOMapWritten,
    ModuleFound,
    ModuleHandle,
)
from sim_backend.firmware.answer import Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.io_map import LiveMap
from sim_backend.firmware.limits import Channel
from sim_backend.firmware.names import matcher

_HANDLE = 0


class ModuleHandlers:
    """Listing of modules, and access to their variables."""

    def __init__(self, maps: Sequence[LiveMap], channel: Channel) -> None:
        """Take the maps in the order in which modules are listed."""
        self._maps, self._channel = maps, channel
        self._by_id = {live.layout.module_id: live for live in maps}
        self._searching = False
        self._found: Iterator[LiveMap] = iter(())

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            FindFirstModule: self.find_first,
            FindNextModule: self.find_next,
            CloseModuleHandle: self.close,
            IOMapRead: self.read,
            IOMapWrite: self.write,
        }

    def find_first(self, command: FindFirstModule) -> Answer:
        """Start the one listing there can be."""
        if self._searching:
            return refuse_with_zeros(FindFirstModule, Status.NO_MORE_HANDLES)
        matches = matcher(command.pattern)
        self._found = iter([live for live in self._maps if matches(live.layout.name)])
        self._searching = True
        return self._next()

    def find_next(self, _: FindNextModule) -> Answer:
        """Continue the listing, also one that was closed."""
        return self._next()

    def close(self, _: CloseModuleHandle) -> Answer:
        """Allow the next listing."""
        self._searching = False
        return answer(ModuleHandle(_HANDLE))

    def _next(self) -> Answer:
        live = next(self._found, None)
        if live is None:
            return refuse_with_zeros(FindFirstModule, Status.MODULE_NOT_FOUND)
        return answer(ModuleFound(_HANDLE, live.layout.name, live.layout.module_id, 0, live.size))

    def read(self, command: IOMapRead) -> Answer:
        """Read variables; the length is capped before the range is checked."""
        size = min(command.size, self._channel.limits.io_map_read)
        live, status = self._locate(command.module_id, command.offset, size)
        if live is None:
            return answer(IOMapData(command.module_id, 0, bytes(size)), status)
        return answer(IOMapData(command.module_id, size, live.read(command.offset, size)))

    def write(self, command: IOMapWrite) -> Answer:
        """Write variables."""
        size = min(command.size, self._channel.limits.io_map_write)
        live, status = self._locate(command.module_id, command.offset, size)
        if live is None:
            return answer(IOMapWritten(command.module_id, 0), status)
        live.write(command.offset, command.data[:size])
        return answer(IOMapWritten(command.module_id, size))

    def _locate(self, module_id: int, offset: int, size: int) -> tuple[LiveMap | None, Status]:
        live = self._by_id.get(module_id)
        if live is None:
            return None, Status.MODULE_NOT_FOUND
        if offset + size > live.size:
            return None, Status.OUT_OF_BOUNDARY
        return live, Status.OK
