"""System calls: requests of a program to other modules. To add one, write its function and enter it in a table.

A call's arguments are the members of a cluster; most calls return their status in the first. An unknown call ends the
program with an error.

Source: LEGO's executable file specification; docs/firmware.md section 8.4.
"""

from __future__ import annotations

from collections.abc import Mapping

from firmware_protocol.direct import LS_LIMIT, RECORD_LIMIT
from firmware_protocol.status import Status
from sim_backend.firmware.cint import divide, s16
from sim_backend.firmware.files.names import NAME_LIMIT
from sim_backend.firmware.mailboxes import LOG
from sim_backend.firmware.sensors.analog import FULL_SCALE
from sim_backend.firmware.sensors.input_port import COLOR_TYPES
from sim_backend.firmware.sensors.low_speed_channel import ChannelError
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.ui.sleep_timer import MINUTE_MS
from sim_backend.firmware.vm.call_types import CALL_TYPES, ENHANCED_CALL_TYPES
from sim_backend.firmware.vm.calls import MOST_ARGUMENTS, Call, Function
from sim_backend.firmware.vm.data import ERR_INSTR, ProgramError
from sim_backend.firmware.vm.draw_calls import TABLE as DRAWING
from sim_backend.firmware.vm.enhanced_calls import TABLE as ENHANCED
from sim_backend.firmware.vm.enhanced_calls import read_map, write_map
from sim_backend.firmware.vm.file_calls import TABLE as FILES
from sim_backend.firmware.vm.high_speed_calls import TABLE as HIGH_SPEED
from sim_backend.firmware.vm.instructions import Instruction, Translation
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.memory import OutOfMemory
from sim_backend.firmware.vm.message_calls import CONNECTIONS
from sim_backend.firmware.vm.message_calls import TABLE as MESSAGES

_RANDOM_LIMIT = 0x7FFF
_BUTTON_COUNT = 4
_LOG_WRAPS = 0x10
_LAST_CALL = 47
"""The last of LEGO's calls."""
_COLORS = 4


def _call(machine: Machine, instruction: Instruction) -> Translation:
    """Run the system call that an instruction names."""
    name, cluster = instruction.arguments
    calls = {**CALLS, **ENHANCED_CALLS} if machine.dialect.enhanced_calls else CALLS
    function = calls.get(name, _nothing if name > _LAST_CALL else None)
    if function is None or name >= machine.dialect.system_calls:
        raise ProgramError(ERR_INSTR, f"system call {name} is not known")
    data = machine.data
    count = data.entry(cluster).data & 0xFFFF
    if count > MOST_ARGUMENTS:
        raise ProgramError(ERR_INSTR, "a system call with too many arguments")
    types = {**CALL_TYPES, **ENHANCED_CALL_TYPES} if machine.dialect.enhanced_calls else CALL_TYPES
    call = Call(machine, data.arguments(cluster, count), types.get(name, ""))
    return lambda: function(call)


def _play_file(call: Call) -> None:
    """Play a sound file at its own rate: status, name, loop, volume; the last byte of the map's name stays as it is."""
    sound = call.devices.sound
    sound.volume, sound.sample_rate, before = _volume(call, 3), 0, sound.name
    sound.play_file(call.text(1).decode("latin-1")[:NAME_LIMIT], loop=call.number(2) == 1)
    sound.name = sound.name[:NAME_LIMIT] + before[NAME_LIMIT:]
    call.put(0, Status.OK)


def _play_tone(call: Call) -> None:
    """Play a tone: status, frequency, duration, loop, volume."""
    sound = call.devices.sound
    sound.volume = _volume(call, 4)
    sound.play_tone(call.number(1) & 0xFFFF, call.number(2) & 0xFFFF, loop=call.number(3) == 1)
    call.put(0, Status.OK)


def _volume(call: Call, position: int) -> int:
    volume = call.number(position)
    return min(volume, MAX_VOLUME) if call.machine.dialect.limits_volume else volume & 0xFF


def _sound_state(call: Call) -> None:
    """Read the state of the sound module: state, flags."""
    call.put(0, call.devices.sound.state)
    call.put(1, call.devices.sound.flags)


def _set_sound_state(call: Call) -> None:
    """Set the sound module's state and some of its flags: result, state, flags."""
    sound = call.devices.sound
    sound.state, sound.flags = call.number(1) & 0xFF, sound.flags | call.number(2) & 0xFF
    sound.wake()
    call.put(0, sound.state)


def _read_button(call: Call) -> None:
    """Read a button: status, number, pressed, times released, whether to clear its counters of releases."""
    number = call.number(1)
    if number >= _BUTTON_COUNT:
        for position, value in ((0, Status.BAD_INPUT_OUTPUT), (2, 0), (3, 0)):
            call.put(position, value)
        return
    button = call.devices.button.buttons[number]
    call.put(2, int(button.pressed))
    call.put(3, button.releases)
    if call.number(4):
        button.forget_releases()
    call.put(0, Status.OK)


def _ls_write(call: Call) -> None:
    """Start an I2C transaction: status, port, bytes to send, number of bytes to read."""
    options, size, bus = call.number(1), call.number(3), call.devices.low_speed
    port, message = bus.write_port(options), call.content(2)
    if port >= len(bus.channels):
        call.put(0, Status.CHANNEL_INVALID)
    elif len(message) > LS_LIMIT or size > LS_LIMIT:
        call.put(0, Status.ILLEGAL_SIZE)
    elif not bus.write(port, message, size, options):
        call.put(0, Status.CHANNEL_NOT_CONFIGURED)
    else:
        error = bus.error_at_once(port)
        call.put(0, error or 0)
        if error not in (None, ChannelError.NO_MESSAGE):
            call.end_pass()


def _ls_read(call: Call) -> None:
    """Fetch the bytes of an I2C transaction: status, port, bytes, most bytes to fetch."""
    port, wanted, bus = call.number(1), call.number(3), call.devices.low_speed
    if port >= len(bus.channels):
        call.put_bytes(2, b"")
        call.put(0, Status.CHANNEL_INVALID)
        return
    status = bus.status(port)
    readable = status in (Status.OK, Status.PENDING)
    call.put_bytes(2, bus.fetch(port, min(wanted, bus.channels[port].ready)) if readable else b"")
    call.put(0, status)


def _ls_status(call: Call) -> None:
    """Read the state of an I2C port: status, port, bytes ready."""
    port, bus = call.number(1), call.devices.low_speed
    if port >= len(bus.channels):
        call.put(2, 0)
        call.put(0, Status.CHANNEL_INVALID)
        return
    call.put(2, bus.channels[port].ready)
    call.put(0, bus.status(port))


def _random(call: Call) -> None:
    call.put(0, call.devices.random.randint(-_RANDOM_LIMIT, _RANDOM_LIMIT))


def _start_tick(call: Call) -> None:
    call.put(0, call.devices.started_ms - 1)


def _keep_alive(call: Call) -> None:
    """Restart the sleep timer: time until power-off in ms."""
    call.devices.ui.stay_awake()
    call.put(0, call.devices.ui.sleep_timer.limit_ms)


def _io_map_read(call: Call) -> None:
    """Read an IO map: status, module, offset, count, bytes."""
    read_map(call, lambda: call.devices.module(call.text(1)))


def _io_map_write(call: Call) -> None:
    """Write an IO map: status, module, offset, bytes."""
    write_map(call, lambda: call.devices.module(call.text(1)))


def _color_sensor(call: Call) -> None:
    """Read a colour sensor: status, port, value (its low byte is set), raw, normalized and scaled values, invalid."""
    ports, port = call.devices.input.ports, call.number(1)
    for position in (3, 4, 5):
        call.resize(position, _COLORS)
    if port >= len(ports) or ports[port].type not in COLOR_TYPES:
        call.put(0, Status.CHANNEL_NOT_CONFIGURED)
        raise ProgramError(Status.CHANNEL_NOT_CONFIGURED - 0x100, f"port {port} is not set up for a colour sensor")
    color = ports[port].color
    call.put(2, call.number(2) & ~0xFF | ports[port].scaled & 0xFF)
    for position, values in ((3, color.readings), (4, color.normalized), (5, color.scaled)):
        call.put_words(position, values)
    call.put(6, ports[port].invalid)
    call.put(0, Status.OK)


def _radio_switch(call: Call) -> None:
    """Switch the radio: whether the switch has begun, on."""
    if not _radio_is_busy(call):
        call.put(0, call.devices.radio.switch(bool(call.number(1)), lead_ms=1))


def _radio_connection(call: Call) -> None:
    """Connect to a brick, or end a connection: result, action, name, connection. No other brick is in reach."""
    if not _radio_is_busy(call):
        has_no_name = not call.text(2) and 0 < call.number(3) < CONNECTIONS
        failure = Status.BLUETOOTH_CONNECT_FAILED << 8 if call.machine.dialect.enhanced_calls else 0
        call.put(0, 1 if has_no_name or not call.number(1) else failure)


def _radio_is_busy(call: Call) -> bool:
    """Return whether the radio is busy, which is a result in firmware 1.32, in two bytes, and 0 in others."""
    is_busy = call.devices.radio.seems_busy
    if is_busy:
        call.put(0, Status.BLUETOOTH_BUSY << 8 if call.machine.dialect.enhanced_calls else 0)
    return is_busy


def _read_semaphore(call: Call) -> None:
    """Read a semaphore: value, which one."""
    call.put(0, call.machine.semaphores[bool(call.number(1))])


def _write_semaphore(call: Call) -> None:
    """Set or clear bits of a semaphore: new value, which one, bits, whether to clear them."""
    which, bits = bool(call.number(1)), call.number(2)
    old = call.machine.semaphores[which]
    call.machine.semaphores[which] = new = (old & ~bits if call.number(3) else old | bits) & 0xFF
    call.put(0, new)


def _calibrated(call: Call) -> None:
    """Scale a raw value by a calibration: result, name, value."""
    found = call.devices.calibrations.find(call.text(1))
    low, high = found or (0, FULL_SCALE)
    call.put(0, Status.OK if found else Status.OUT_OF_RANGE)
    call.put(2, min(max(divide((s16(call.number(2)) - low) * 100, high - low), 0), 100))


def _calibrate(call: Call) -> None:
    """Store a calibration: result, name, lowest and highest raw value."""
    call.devices.calibrations.store(call.text(1), s16(call.number(2)), s16(call.number(3)))
    call.put(0, Status.OK)


def _set_sleep_time(call: Call) -> None:
    """Set the time until power-off: result (not written), ms; a minute at least, or 0 for never."""
    duration_ms = call.number(1)
    call.devices.ui.set_sleep_minutes(max(duration_ms // MINUTE_MS, 1) if duration_ms else 0)


def _log_times(call: Call) -> None:
    """Read the clock of the data log: nothing, time, the brick's time at that moment."""
    for position, value in enumerate(call.devices.log_times(), 1):
        call.put(position, value)


def _log(call: Call) -> None:
    """Write a record of the data log: status, bytes.

    Raises:
        OutOfMemory: The pool is full, which ends the program.
    """
    record = call.live(1)
    if len(record) > RECORD_LIMIT:
        call.put(0, Status.ILLEGAL_SIZE)
        return
    try:
        call.put(0, _LOG_WRAPS if call.devices.mailboxes.write(LOG, record) else Status.OK)
    except OutOfMemory:
        call.put(0, Status.OUT_OF_MEMORY)
        raise


def _nothing(_: Call) -> None:
    """Do nothing: the call is not simulated."""


CALLS: Mapping[int, Function] = {
    **FILES,
    9: _play_file,
    10: _play_tone,
    11: _sound_state,
    12: _set_sound_state,
    **DRAWING,
    20: _read_button,
    21: _ls_write,
    22: _ls_read,
    23: _ls_status,
    24: _random,
    25: _start_tick,
    **MESSAGES,
    31: _keep_alive,
    32: _io_map_read,
    33: _io_map_write,
    34: _color_sensor,
    35: _radio_switch,
    36: _radio_connection,
    37: _ls_write,
    38: _ls_read,
    39: _ls_status,
    40: _read_semaphore,
    41: _write_semaphore,
    42: _calibrated,
    43: _calibrate,
    44: _log,
    45: _log_times,
    46: _set_sleep_time,
}
"""Number of each call to its function. Those of the high speed port are the ones of I2C."""

ENHANCED_CALLS: Mapping[int, Function] = {
    **ENHANCED,
    **HIGH_SPEED,
}
"""Those of firmware 1.32. Numbers up to 99 without an entry do nothing."""

TABLE: Mapping[tuple[int, int], Translate] = {(0x28, 2): _call}
"""Opcode and number of arguments to the function that translates it."""
