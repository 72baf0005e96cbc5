"""System calls: requests of a program to other modules. To add one, write its function and enter it in the table.

A call's arguments are the members of a cluster; most calls return their status in the first. An unknown call ends the
program with an error.

Source: LEGO's executable file specification.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_protocol.direct import LS_LIMIT, MESSAGE_LIMIT
from firmware_protocol.status import Status
from sim_backend.firmware.mailboxes import MAILBOXES
from sim_backend.firmware.names import NAME_LIMIT
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.vm.arrays import elements, text
from sim_backend.firmware.vm.machine import Instruction, Machine, ProgramError, number
from sim_backend.firmware.vm.memory import OutOfMemory, Value

_OK = int(Status.OK)
_RANDOM_LIMIT = 0x7FFF

Arguments = list[int]
"""Numbers of the variables in a call's cluster."""


def call(machine: Machine, instruction: Instruction) -> None:
    """Run the system call that an instruction names."""
    name, cluster = instruction.arguments
    function = TABLE.get(name)
    if function is None:
        raise ProgramError(f"system call {name} is not known")
    function(machine, machine.memory.members(cluster))


def _number(machine: Machine, variable: int) -> int:
    return number(machine.get(variable))


def _bytes(value: Value) -> bytes:
    return bytes(number(element) & 0xFF for element in elements(value))


def _play_file(machine: Machine, arguments: Arguments) -> None:
    status, name, loop, volume = arguments
    devices, file = machine.devices, text(machine.get(name))[:NAME_LIMIT]
    devices.sound.volume = min(_number(machine, volume), MAX_VOLUME)
    devices.sound.play_file(file, loop=bool(_number(machine, loop)))
    machine.put(status, _OK)


def _play_tone(machine: Machine, arguments: Arguments) -> None:
    """Play a tone once; the loop argument is ignored."""
    status, frequency, duration, _, volume = arguments
    sound = machine.devices.sound
    sound.volume = min(_number(machine, volume), MAX_VOLUME)
    sound.play_tone(_number(machine, frequency) & 0xFFFF, _number(machine, duration) & 0xFFFF)
    machine.put(status, _OK)


def _sound_state(machine: Machine, arguments: Arguments) -> None:
    state, flags = arguments
    machine.put(state, machine.devices.sound.state)
    machine.put(flags, machine.devices.sound.flags)


def _set_sound_state(machine: Machine, arguments: Arguments) -> None:
    result, state, flags = arguments
    sound = machine.devices.sound
    sound.state, sound.flags = _number(machine, state) & 0xFF, _number(machine, flags) & 0xFF
    sound.wake()
    machine.put(result, sound.state)


def _draw(machine: Machine, arguments: Arguments) -> None:
    """Succeed without effect: drawing is not simulated."""
    machine.put(arguments[0], _OK)


def _read_button(machine: Machine, arguments: Arguments) -> None:
    status, index, pressed, count, reset = arguments
    button = machine.devices.button.buttons[_number(machine, index) % len(machine.devices.button.buttons)]
    machine.put(pressed, int(button.pressed))
    machine.put(count, button.presses)
    if _number(machine, reset):
        button.presses = 0
    machine.put(status, _OK)


def _ls_write(machine: Machine, arguments: Arguments) -> None:
    status, port, data, receive = arguments
    message, size = _bytes(machine.get(data)), _number(machine, receive)
    bus, index = machine.devices.low_speed, _number(machine, port)
    if not 0 <= index < len(bus.channels):
        machine.put(status, Status.OUT_OF_RANGE)
    elif len(message) > LS_LIMIT or not 0 <= size <= LS_LIMIT:
        machine.put(status, Status.ILLEGAL_SIZE)
    else:
        machine.put(status, _OK if bus.write(index, message, size) else Status.CHANNEL_NOT_CONFIGURED)


def _ls_read(machine: Machine, arguments: Arguments) -> None:
    status, port, data, length = arguments
    bus, index = machine.devices.low_speed, _number(machine, port)
    if not 0 <= index < len(bus.channels):
        machine.put(status, Status.OUT_OF_RANGE)
        return
    state, channel, wanted = bus.status(index), bus.channels[index], _number(machine, length)
    received = channel.fetch() if wanted <= channel.ready else b""
    machine.put(data, [*received[:wanted]])
    machine.put(status, state)


def _ls_status(machine: Machine, arguments: Arguments) -> None:
    status, port, ready = arguments
    bus, index = machine.devices.low_speed, _number(machine, port)
    if not 0 <= index < len(bus.channels):
        machine.put(status, Status.OUT_OF_RANGE)
        return
    machine.put(status, bus.status(index))
    machine.put(ready, bus.channels[index].ready)


def _random(machine: Machine, arguments: Arguments) -> None:
    machine.put(arguments[0], machine.devices.random.randint(-_RANDOM_LIMIT - 1, _RANDOM_LIMIT))


def _start_tick(machine: Machine, arguments: Arguments) -> None:
    machine.put(arguments[0], machine.devices.started_ms)


def _message_write(machine: Machine, arguments: Arguments) -> None:
    status, box, message = arguments
    index, data = _number(machine, box), _bytes(machine.get(message))
    if not 0 <= index < MAILBOXES:
        machine.put(status, Status.ILLEGAL_MAILBOX)
    elif not 0 < len(data) <= MESSAGE_LIMIT:
        machine.put(status, Status.OUT_OF_RANGE)
    else:
        try:
            machine.devices.mailboxes.write(index, data)
            machine.put(status, _OK)
        except OutOfMemory:
            machine.put(status, Status.OUT_OF_MEMORY)


def _message_read(machine: Machine, arguments: Arguments) -> None:
    status, box, message, remove = arguments
    index = _number(machine, box)
    if not 0 <= index < MAILBOXES:
        machine.put(status, Status.ILLEGAL_MAILBOX)
        return
    data = machine.devices.mailboxes.read(index, remove=bool(_number(machine, remove)))
    machine.put(message, [0] if data is None else [*data])
    machine.put(status, Status.MAILBOX_EMPTY if data is None else _OK)


def _keep_alive(machine: Machine, arguments: Arguments) -> None:
    machine.devices.ui.stay_awake()
    machine.put(arguments[0], machine.devices.ui.sleep_ms)


def _io_map_read(machine: Machine, arguments: Arguments) -> None:
    status, module, offset, count, data = arguments
    live = machine.devices.maps.get(text(machine.get(module)))
    at, size = _number(machine, offset), _number(machine, count)
    if live is None:
        machine.put(status, Status.MODULE_NOT_FOUND)
    elif not 0 <= at <= at + size <= live.size:
        machine.put(status, Status.OUT_OF_BOUNDARY)
    else:
        machine.put(data, [*live.read(at, size)])
        machine.put(status, _OK)


def _io_map_write(machine: Machine, arguments: Arguments) -> None:
    status, module, offset, data = arguments
    live, at, new = machine.devices.maps.get(text(machine.get(module))), _number(machine, offset), machine.get(data)
    if live is None:
        machine.put(status, Status.MODULE_NOT_FOUND)
    elif not 0 <= at <= at + len(elements(new)) <= live.size:
        machine.put(status, Status.OUT_OF_BOUNDARY)
    else:
        live.write(at, _bytes(new))
        machine.put(status, _OK)


def _open_read(machine: Machine, arguments: Arguments) -> None:
    status, handle, name, length = arguments
    opened = machine.devices.loader.open_read(text(machine.get(name)))
    _opened(machine, (status, handle, length), opened)


def _open_write(machine: Machine, arguments: Arguments) -> None:
    """Create a data file of the given length."""
    status, handle, name, length = arguments
    size = _number(machine, length)
    opened = machine.devices.loader.create(text(machine.get(name)), size, appendable=True)
    _opened(machine, (status, handle, length), opened._replace(size=size))


def _open_append(machine: Machine, arguments: Arguments) -> None:
    status, handle, name, length = arguments
    opened = machine.devices.loader.append(text(machine.get(name)))
    _opened(machine, (status, handle, length), opened)


def _opened(machine: Machine, targets: tuple[int, int, int], opened: tuple[int, int, int]) -> None:
    for target, value in zip(targets, opened, strict=True):
        machine.put(target, value)


def _file_read(machine: Machine, arguments: Arguments) -> None:
    status, handle, data, length = arguments
    found, content = machine.devices.loader.read(_number(machine, handle), _number(machine, length))
    machine.put(data, [*content])
    machine.put(length, len(content))
    machine.put(status, found)


def _file_write(machine: Machine, arguments: Arguments) -> None:
    status, handle, data, length = arguments
    content = _bytes(machine.get(data))[: _number(machine, length)]
    found, written = machine.devices.loader.write(_number(machine, handle), content)
    machine.put(length, written)
    machine.put(status, found)


def _file_close(machine: Machine, arguments: Arguments) -> None:
    status, handle = arguments
    machine.put(status, machine.devices.loader.close(_number(machine, handle)))


def _file_delete(machine: Machine, arguments: Arguments) -> None:
    status, name = arguments
    machine.put(status, machine.devices.loader.delete(text(machine.get(name))))


TABLE: Mapping[int, Callable[[Machine, Arguments], None]] = {
    0: _open_read,
    1: _open_write,
    2: _open_append,
    3: _file_read,
    4: _file_write,
    5: _file_close,
    8: _file_delete,
    9: _play_file,
    10: _play_tone,
    11: _sound_state,
    12: _set_sound_state,
    **dict.fromkeys(range(13, 20), _draw),
    20: _read_button,
    21: _ls_write,
    22: _ls_read,
    23: _ls_status,
    24: _random,
    25: _start_tick,
    26: _message_write,
    27: _message_read,
    31: _keep_alive,
    32: _io_map_read,
    33: _io_map_write,
}
"""Number of each call to its function."""
