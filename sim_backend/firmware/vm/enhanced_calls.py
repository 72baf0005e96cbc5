"""System calls that only firmware 1.32 has. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_protocol.status import Status
from sim_backend.firmware.files.file_header import File
from sim_backend.firmware.files.names import NAME_SIZE, pack_name
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.vm.calls import Call, Function
from sim_backend.firmware.vm.enhanced_drawing import DRAWING
from sim_backend.firmware.vm.file_calls import name_at, put_status, returned
from sim_backend.firmware.vm.loader_call import execute_loader

_NO_POSITION = 0x9C
"""Status of a position outside of a file."""

_START, _CURRENT, _END = range(3)
_RESIZE = 4
"""Origins from this number on select another command of the loader."""
_MODULUS, _FACTOR = 2**31 - 1, 48271
"""Of the random numbers."""


def _find_first(call: Call) -> None:
    """Start a listing: status, handle, pattern and then name, length."""
    _found(call, *call.devices.loader.find_first(name_at(call, 2)))


def _find_next(call: Call) -> None:
    """Continue a listing, as `_find_first`."""
    _found(call, *call.devices.loader.find_next(call.number(1) & 0xFF))


def _found(call: Call, status: Status, handle: int, file: File | None) -> None:
    data = call.machine.data
    index = data.index_of(call.members[2])
    data.memory.resize(index, NAME_SIZE)
    if file is not None:
        data.memory.write(data.memory.array(index).offset, pack_name(file.name))
    _put_found(call, status, handle, file)


def _put_found(call: Call, status: Status, handle: int, file: File | None) -> None:
    """Return a file that was looked for, with its size, unless the name was refused or there was no handle."""
    call.put(1, handle)
    if status not in (Status.NO_MORE_HANDLES, Status.ILLEGAL_FILE_NAME):
        call.put(3, 0 if file is None else file.size)
    put_status(call, status)


def _open_write_linear(call: Call) -> None:
    """Create a file in one block: status, handle, name, length."""
    size = call.number(3)
    returned(call, call.devices.loader.create(name_at(call, 2), size, linear=True)._replace(size=size))


def _open_write(call: Call) -> None:
    """Create a file, as `_open_write_linear`."""
    size = call.number(3)
    returned(call, call.devices.loader.create(name_at(call, 2), size)._replace(size=size))


def _open_read_linear(call: Call) -> None:
    """Open a file that is in one block: status, handle, name, length."""
    _put_found(call, *call.devices.loader.open_block(name_at(call, 2)))


def _seek(call: Call) -> None:
    """Set where a file is read or written on: status, handle, origin, distance."""
    loader, number, origin = call.devices.loader, call.number(1), call.number(2)
    if origin >= _RESIZE:
        _resize(call)
        return
    handle = loader.opened(number)
    if handle is None:
        put_status(call, Status.ILLEGAL_HANDLE)
        return
    if origin > _END:
        call.put(3, 0)
        origin = _CURRENT
    place = {_START: 0, _CURRENT: handle.position, _END: handle.size}[origin] + call.signed(3)
    if place == handle.position or 0 <= place <= handle.size:
        handle.seek(place, loader.flash.file(handle.index))
        put_status(call, Status.OK)
    else:
        put_status(call, _NO_POSITION)


def _tell(call: Call) -> None:
    """Return where a file is read on, or was written on after the last seek: status, handle, position."""
    loader, number = call.devices.loader, call.number(1)
    handle = loader.opened(number)
    if handle is None:
        put_status(call, Status.ILLEGAL_HANDLE)
        return
    call.put(2, handle.position)
    put_status(call, Status.OK)


def _resize(call: Call) -> None:
    """Change nothing: result and handle become 0."""
    call.put(0, 0)
    call.put(1, 0)


def _memory_sizes(call: Call) -> None:
    """Read the sizes of pool and variables: status, whether to move the arrays together first, pool, variables."""
    memory = call.machine.memory
    if call.number(1):
        memory.compact()
    call.put(2, memory.base + memory.end)
    call.put(3, memory.end)
    call.put(0, Status.OK)


def _last_response(call: Call) -> None:
    """Read the last reply of another brick: status, whether to clear it, length, command, bytes. There is none."""
    call.put(2, 0)
    call.put_bytes(4, b"")
    call.put(0, Status.OK)


def _random(call: Call) -> None:
    """Draw a random number, or set the seed: number, whether to set; 0 takes the time, -1 the last seed."""
    machine = call.machine
    if call.number(1):
        seed = call.signed(0)
        if seed >= 0:
            machine.random_seed = seed or machine.tick
        machine.random_state = machine.random_seed
    else:
        machine.random_state = machine.random_state * _FACTOR % _MODULUS or _MODULUS
    call.put(0, machine.random_state)


def _io_map_read(call: Call) -> None:
    """Read an IO map: status, number of the module, offset, count, bytes."""
    read_map(call, lambda: call.devices.module_of(call.number(1)))


def _io_map_write(call: Call) -> None:
    """Write an IO map: status, number of the module, offset, bytes."""
    write_map(call, lambda: call.devices.module_of(call.number(1)))


def read_map(call: Call, module: Callable[[], LiveMap | Status]) -> None:
    """Return a part of an IO map; the size is checked before the module is looked up."""
    at, size = call.number(2), call.number(3)
    if size > call.machine.dialect.map_limit:
        call.put_bytes(4, b"")
        call.put(0, Status.ILLEGAL_SIZE)
        return
    live = module()
    if isinstance(live, Status):
        call.put(0, live)
    elif at + size > live.size:
        call.put(0, Status.OUT_OF_BOUNDARY)
    else:
        call.put_bytes(4, live.read(at, size))
        call.put(0, Status.OK)


def write_map(call: Call, module: Callable[[], LiveMap | Status]) -> None:
    """Write to an IO map."""
    at, new = call.number(2), call.content(3)
    live = module() if len(new) <= call.machine.dialect.map_limit else Status.ILLEGAL_SIZE
    if isinstance(live, Status):
        call.put(0, live)
    elif at + len(new) > live.size:
        call.put(0, Status.OUT_OF_BOUNDARY)
    else:
        live.write(at, new)
        call.put(0, Status.OK)


TABLE: Mapping[int, Function] = {
    78: _io_map_read,
    79: _io_map_write,
    82: execute_loader,
    83: _find_first,
    84: _find_next,
    85: _open_write_linear,
    86: _open_write,
    87: _open_read_linear,
    90: _seek,
    91: _resize,
    96: _memory_sizes,
    97: _last_response,
    98: _tell,
    99: _random,
    **DRAWING,
}
"""Number of each call to its function."""
