"""RAM around the send buffers of the four I2C ports: the bytes that a port sends beyond its message.

An empty message makes a port send until its 8-bit byte counter wraps, and a retry sends the bytes beyond the message.
The send buffers are followed by the receive buffers, some counters and the module's IO map. Order and sizes were taken
from the bytes on the wire in the recorded conversation i2c_sizes, those of the map from docs/firmware.md section 5.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

WRAP = 256
"""Number of bytes sent for an empty message."""

_POINTERS = bytes(2)
_BUFFER = 16
_COUNTERS = 9
_TIMER_RUNS = b"\x01"
_PADDING = bytes(6)
_MAP_PORT, _MAP_END = 3, bytes(3)


class Port(Protocol):
    """The state of one port that is in RAM."""

    tx: bytes
    rx: bytearray
    rx_in: int
    rx_out: int
    rx_size: int
    received: int

    @property
    def registers(self) -> tuple[int, int, int]:
        """Mode, state and error."""


def from_send_buffer(ports: Sequence[Port], index: int) -> bytes:
    """RAM from the start of a port's send buffer, more than `WRAP` bytes."""
    send = b"".join(port.tx + _POINTERS for port in ports)
    receive = b"".join(bytes(_BUFFER + 1) + bytes([port.received]) for port in ports)
    ram = send + receive + bytes(_COUNTERS) + _TIMER_RUNS + _PADDING + _io_map(ports)
    start = index * (_BUFFER + len(_POINTERS))
    return ram[start : start + WRAP + 2 * _BUFFER].ljust(WRAP + 2 * _BUFFER, b"\0")


def _io_map(ports: Sequence[Port]) -> bytes:
    received = b"".join(bytes(port.rx) + bytes([port.rx_in, port.rx_out, port.rx_size]) for port in ports)
    sent = b"".join(port.tx + bytes(_MAP_PORT) for port in ports)
    states = b"".join(bytes(row) for row in zip(*(port.registers for port in ports), strict=True))
    return received + sent + states + _MAP_END
