"""System calls for files. A status is the loader's, in the upper byte of 16 bits.

Source: docs/firmware.md section 8.4.
"""

from __future__ import annotations

from collections.abc import Mapping

from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import HANDLES, Opened
from sim_backend.firmware.vm.calls import Call, Function

_NO_HANDLE = 0xFF
_NOTHING = "", False
"""What a program remembers of a handle by which it has no file open."""


def put_status(call: Call, status: int) -> None:
    """Return a status of the loader."""
    call.put(0, status << 8)


def name_at(call: Call, position: int) -> str:
    """Return the file name among the arguments."""
    return call.text(position).decode("latin-1")


def _open_read(call: Call) -> None:
    """Open a file to read it: status, handle, name, length."""
    returned(call, call.devices.loader.open_read(name_at(call, 2)), writes=False)


def _open_write(call: Call) -> None:
    """Create a data file: status, handle, name, length."""
    size = call.number(3)
    returned(call, call.devices.loader.create(name_at(call, 2), size, appendable=True)._replace(size=size))


def _open_append(call: Call) -> None:
    """Open a data file to write more: status, handle, name, space left."""
    opened = call.devices.loader.append(name_at(call, 2))
    returned(call, opened)
    call.put(3, opened.size)


def returned(call: Call, opened: Opened, *, writes: bool = True) -> None:
    """Return an opened file, which the program remembers by its name: status, handle, length."""
    put_status(call, opened.status)
    call.put(1, opened.handle)
    if opened.status == Status.OK:
        call.machine.handles[opened.handle] = name_at(call, 2), writes
        call.put(3, opened.size)


def _read(call: Call) -> None:
    """Read from a file into a text: status, handle, text, length."""
    wanted, text = call.number(3) & 0xFFFF, call.members[2]
    status, content = call.devices.loader.read(call.number(1), wanted)
    data = call.machine.data
    index = data.index_of(text)
    data.memory.resize(index, wanted + 1 & 0xFFFF)
    if status == Status.ILLEGAL_HANDLE:
        content = data.memory.bytes_of(index)[:wanted]
    else:
        call.put(3, len(content))
    data.memory.write(data.memory.array(index).offset, content + b"\0")
    put_status(call, status)


def _write(call: Call) -> None:
    """Write to a file: status, handle, bytes, length, which may be more than the array has."""
    status, written = call.devices.loader.write(call.number(1), call.content(2, call.number(3)))
    call.put(3, written)
    put_status(call, status)


def _close(call: Call) -> None:
    """Close a file: status, handle."""
    handle = call.number(1)
    call.machine.handles.pop(handle, None)
    put_status(call, call.devices.loader.close(handle) if handle < HANDLES else Status.ILLEGAL_HANDLE)


def _resolve(call: Call) -> None:
    """Return the handle by which the program opened a file: status, handle, whether it is for writing, name."""
    name, opened = name_at(call, 3), call.machine.handles
    for handle in range(HANDLES):
        kept, writes = opened.get(handle, _NOTHING)
        if kept == name:
            call.put(1, handle)
            call.put(2, int(writes))
            put_status(call, Status.OK)
            return
    call.put(1, _NO_HANDLE)
    put_status(call, Status.HANDLE_ALREADY_CLOSED)


def _rename(call: Call) -> None:
    """Rename a file: status, old name, new name."""
    put_status(call, call.devices.loader.rename(name_at(call, 1), name_at(call, 2)).status)


def _delete(call: Call) -> None:
    """Delete a file: status, name."""
    put_status(call, call.devices.loader.delete(name_at(call, 1)))


def _list(call: Call) -> None:
    """List files: result, pattern, names."""
    loader, names = call.devices.loader, list[bytes]()
    status, handle, file = loader.find_first(name_at(call, 1))
    if status == Status.OK:
        while file is not None:
            names.append(file.name.encode("latin-1"))
            file = loader.find_next(handle)[2]
        loader.close(handle)
    call.put_texts(2, names)
    call.put(0, Status.OK)


TABLE: Mapping[int, Function] = {
    0: _open_read,
    1: _open_write,
    2: _open_append,
    3: _read,
    4: _write,
    5: _close,
    6: _resolve,
    7: _rename,
    8: _delete,
    47: _list,
}
"""Number of each call to its function."""
