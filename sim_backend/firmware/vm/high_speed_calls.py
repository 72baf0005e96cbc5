"""System calls of firmware 1.32 for the high speed port. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_protocol.iomap import COMM
from firmware_protocol.status import Status
from sim_backend.firmware.high_speed import HighSpeedState
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.vm.calls import Call, Function

_MODE_AT = 1896
"""Offset of the line's format in the Comm map, after the end of other versions' map."""
_STATES = {0: HighSpeedState.ENABLE, 1: HighSpeedState.INITIALISE, 2: HighSpeedState.EXIT}
"""Function to the state that it requests."""
_LONGEST = 128
"""Bytes that can be sent, and of the buffer of the receiver."""


def _comm_map(call: Call) -> LiveMap:
    return next(live for live in call.devices.maps if live.layout is COMM)


def _request(call: Call, state: int) -> None:
    call.devices.high_speed.request(state)
    call.put(0, state)


def _write(call: Call) -> None:
    """Send bytes: state, bytes."""
    content = call.content(1)
    if len(content) > _LONGEST:
        call.put(0, Status.ILLEGAL_SIZE)
        return
    _comm_map(call).store(COMM.field("HsOutBuf").offset, content)
    call.devices.high_speed.to_send, call.devices.high_speed.sent = len(content), 0
    _request(call, HighSpeedState.SEND)


def _read(call: Call) -> None:
    """Fetch all bytes that have arrived: status (not written if there are none), bytes."""
    content = call.devices.high_speed.fetch(_LONGEST)
    call.put_bytes(1, content)
    if content:
        call.put(0, Status.OK)


def _status(call: Call) -> None:
    """Read the state of the port: number of bytes that still have to be sent, and of those that have arrived."""
    call.put(0, call.devices.high_speed.remaining)
    call.put(1, call.devices.high_speed.waiting)


def _control(call: Call) -> None:
    """Enable, set up or disable the port: state, function, speed, format."""
    function, port = call.number(1), call.devices.high_speed
    if function == 1:
        live = _comm_map(call)
        live.store(COMM.field("HsSpeed").offset, bytes((call.number(2),)))
        live.store(_MODE_AT, call.number(3).to_bytes(2, "little"))
    port.ring_in = port.ring_out = port.to_send = port.sent = 0
    if function in _STATES:
        _request(call, _STATES[function])
    else:
        call.put(0, port.state)


TABLE: Mapping[int, Function] = {
    37: _write,
    38: _read,
    39: _status,
    88: _control,
}
"""Number of each call to its function."""
