"""RAM of the low speed module, from which a port sends more than its message.

An empty message makes a port send until its 8-bit byte counter wraps: the buffer with the last bytes sent and the
memory after it, which has the receive buffers, some counters and the module's IO map. Order and sizes were taken from
the bytes on the wire in the recorded conversation i2c_sizes. A retry continues in the map where the last attempt ended.

Source: docs/firmware.md section 7; the map's layout is in section 5.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import overload

from firmware_protocol.iomap import LOW_SPEED
from sim_backend.firmware.sensors.i2c import BUFFER
from sim_backend.firmware.sensors.low_speed_channel import Channel

WRAP = 256
"""Number of bytes sent for an empty message."""

_POINTERS = 2
_SIZE = BUFFER + _POINTERS
_MAP_BLOCK = BUFFER + 3
"""Bytes of a buffer in the map, with its pointers and size."""

_COUNTERS = 1
_TIMER_RUNS = b"\x01"
_PADDING = bytes(6)
_MAP_END = bytes(2)


class AfterSendBuffer(Sequence[int]):
    """The bytes that a port sends for an empty message, each as it is in the RAM when it is taken."""

    def __init__(self, ports: Sequence[Channel], active: Callable[[], int], index: int) -> None:
        """Begin with the send buffer of port `index`; `active` returns the state byte of the map."""
        self._ports, self._active = ports, active
        self._start = index * _SIZE

    def __len__(self) -> int:
        return WRAP

    @overload
    def __getitem__(self, place: int) -> int: ...
    @overload
    def __getitem__(self, place: slice) -> bytes: ...
    def __getitem__(self, place: int | slice) -> int | bytes:
        ram = _ram(self._ports, self._active())
        return ram[self._start :].ljust(WRAP, b"\0")[place]


def _ram(ports: Sequence[Channel], active: int) -> bytes:
    send = b"".join(port.sending + bytes([port.sent, 0]) for port in ports)
    receive = b"".join(port.bus.left + bytes([0, port.received]) for port in ports)
    counters = bytes(port.waited for port in ports) + bytes(port.failures for port in ports) + bytes(_COUNTERS)
    return send + receive + counters + _TIMER_RUNS + _PADDING + _io_map(ports, active)


def read_on(ports: Sequence[Channel], active: int, index: int, count: int) -> bytes:
    """Take bytes out of the memory after a port's receive buffer, where further receive buffers are cleared."""
    ports[index].received = 0
    start = (len(ports) + index) * _SIZE + BUFFER
    data = _ram(ports, active)[start : start + count].ljust(count, b"\0")
    left = count - _POINTERS
    for port in ports[index + 1 :]:
        if left > 0:
            port.bus.read(min(left, BUFFER))
        if left >= _SIZE:
            port.received = 0
        left -= _SIZE
    return data


def after_receive_ring(ports: Sequence[Channel], active: int, index: int) -> bytes:
    """Return the map from the receive ring of a port on, and as many zeros as its pointer can reach."""
    return _io_map(ports, active)[LOW_SPEED.field("InBuf", index).offset :].ljust(WRAP + BUFFER, b"\0")


def store_behind(ports: Sequence[Channel], index: int, place: int, byte: int) -> None:
    """Store a byte in the map, as far as the buffers of the ports reach, counted from a port's receive ring on."""
    block, place = divmod(LOW_SPEED.field("InBuf", index).offset + place, _MAP_BLOCK)
    if block < len(ports):
        _store(ports[block], place, byte, ("rx", "rx_in", "rx_out", "rx_size"))
    elif block < 2 * len(ports):
        _store(ports[block - len(ports)], place, byte, ("tx", "tx_size", "tx_out", "tx_spare"))


def _store(port: Channel, place: int, byte: int, fields: tuple[str, ...]) -> None:
    if place < BUFFER:
        content = getattr(port, fields[0])
        setattr(port, fields[0], content[:place] + bytes((byte,)) + content[place + 1 :])
    else:
        setattr(port, fields[place - BUFFER + 1], byte)


def after_map_buffer(ports: Sequence[Channel], active: int, index: int) -> bytes:
    """Return the bytes that a port sends in its next attempt."""
    port = ports[index]
    start = LOW_SPEED.field("OutBuf", index).offset + port.tx_out
    return _io_map(ports, active)[start : start + port.tx_size].ljust(port.tx_size, b"\0")


def _io_map(ports: Sequence[Channel], active: int) -> bytes:
    received = b"".join(port.rx + bytes([port.rx_in, port.rx_out, port.rx_size]) for port in ports)
    sent = b"".join(port.tx + bytes([port.tx_size, port.tx_out, port.tx_spare]) for port in ports)
    states = zip(*((port.mode, port.state, port.error) for port in ports), strict=True)
    return received + sent + b"".join(map(bytes, states)) + bytes([active]) + _MAP_END
