"""The system call of firmware 1.32 for any command of the loader. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from functools import partial

from firmware_protocol.status import Status
from sim_backend.firmware.files.file_header import File
from sim_backend.firmware.files.loader import Loader, Opened
from sim_backend.firmware.files.names import NAME_LIMIT, matcher, pack_name
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.vm.calls import Call

_NAME, _BUFFER, _LENGTH = 2, 3, 4
"""Positions of the arguments; for a file that is open the name is its handle, one byte."""
_MODULE = struct.Struct("<20sIIH")
"""A module that was found: name, number, size and size of the map."""

Result = tuple[int, int]
"""Status and handle."""


def execute_loader(call: Call) -> None:
    """Carry out a command of the loader: status and handle, command, name, bytes, length."""
    function = _COMMANDS.get(call.number(1) & 0xFF)
    status, handle = (0, 0) if function is None else function(call, call.devices.loader)
    call.put(0, status << 8 | handle)


def _name(call: Call) -> str:
    return call.text(_NAME).decode("latin-1")


def _handle(call: Call) -> int:
    return call.content(_NAME, 1)[0]


def _store(call: Call, content: bytes) -> None:
    """Write to the bytes, however many the array has."""
    data = call.machine.data
    data.memory.write(data.memory.array(data.index_of(call.members[_BUFFER])).offset, content)


def _opened(call: Call, opened: Opened, *, sized: bool = True) -> Result:
    """Return the size, too, unless it is left as it is."""
    if sized:
        call.put(_LENGTH, opened.size)
    return opened.status, opened.handle


def _open_read(call: Call, loader: Loader) -> Result:
    opened = loader.open_read(_name(call))
    return _opened(call, opened, sized=opened.status == Status.OK)


def _open_read_linear(call: Call, loader: Loader) -> Result:
    status, handle, file = loader.open_block(_name(call))
    if file is not None and not status:
        _store(call, file.start.to_bytes(4, "little"))
    return _opened(call, Opened(status, handle, 0 if file is None else file.size))


def _create(call: Call, loader: Loader, *, linear: bool = False, appendable: bool = False) -> Result:
    created = loader.create(_name(call), call.number(_LENGTH), linear=linear, appendable=appendable)
    return _opened(call, created, sized=False)


def _read(call: Call, loader: Loader) -> Result:
    status, content = loader.read(_handle(call), call.number(_LENGTH))
    if status != Status.ILLEGAL_HANDLE:
        call.put(_LENGTH, len(content))
        _store(call, content)
    return status, _handle(call)


def _write(call: Call, loader: Loader) -> Result:
    status, written = loader.write(_handle(call), call.content(_BUFFER, call.number(_LENGTH)))
    call.put(_LENGTH, written)
    return status, _handle(call)


def _delete(call: Call, loader: Loader) -> Result:
    """Delete a file; the handle is that of the search."""
    handle = loader.next_handle
    return loader.delete(_name(call)), handle


def _rename(call: Call, loader: Loader) -> Result:
    """Rename a file; the length is that of the last one that was looked for: the one of the new name, or the old."""
    name, new_name = _name(call), call.text(_BUFFER).decode("latin-1")
    files = [file for each in (new_name, name) for file in loader.flash.files if matcher(each)(file.name)]
    size = files[0].data_size if files else 0
    status, handle, _ = loader.rename(name, new_name)
    if len(new_name) <= NAME_LIMIT:
        call.put(_LENGTH, size)
    return status, handle


def _found(call: Call, status: Status, handle: int, file: File | None) -> Result:
    call.put(_LENGTH, 0 if file is None else file.size)
    if file is not None:
        _store(call, pack_name(file.name))
    return status, handle


def _found_module(call: Call, found: LiveMap | Status) -> Result:
    if isinstance(found, Status):
        return found, 0
    _store(call, _MODULE.pack(pack_name(found.layout.name), found.layout.module_id, 0, found.size))
    return Status.OK, 0


def _close_modules(call: Call) -> Result:
    call.devices.module_search.close()
    return Status.OK, 0


_COMMANDS: Mapping[int, Callable[[Call, Loader], Result]] = {
    0x80: _open_read,
    0x81: _create,
    0x82: _read,
    0x83: _write,
    0x84: lambda call, loader: (loader.close(_handle(call)), _handle(call)),
    0x85: _delete,
    0x86: lambda call, loader: _found(call, *loader.find_first(_name(call))),
    0x87: lambda call, loader: _found(call, *loader.find_next(_handle(call))),
    0x89: partial(_create, linear=True),
    0x8A: _open_read_linear,
    0x8B: partial(_create, appendable=True),
    0x8C: lambda call, loader: _opened(call, loader.append(_name(call))),
    0x8D: lambda call, loader: (loader.crop(_handle(call)), _handle(call)),
    0x90: lambda call, _: _found_module(call, call.devices.module_search.first(_name(call))),
    0x91: lambda call, _: _found_module(call, call.devices.module_search.following()),
    0x92: lambda call, _: _close_modules(call),
    0xA3: _rename,
}
"""Number of each command to its function, which are those of the telegrams."""
