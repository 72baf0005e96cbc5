"""The I2C bus between an input port and a digital sensor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

ADDRESS_CLOCKS = 9
"""Clock pulses of one byte including its acknowledge."""

STEPS_PER_MS = 23.4375
FRAME_STEPS, TX_STEPS = 20, 21
"""Timer interrupts per millisecond, for start and stop, and per byte written; with those for reading in `low_speed`
they reproduce all measured durations (docs/firmware.md section 7)."""

_CLOCK_STEPS = 2


@runtime_checkable
class I2CDevice(Protocol):
    """A digital sensor.

    Attributes:
        address: Its address in the 8-bit write form, such as 0x02.
    """

    address: int

    def write(self, data: bytes) -> None:
        """Receive the bytes after the address."""

    def read(self, size: int) -> bytes:
        """Return `size` bytes."""


class I2CBus:
    """The bus of one port, with at most one device, as LEGO's cables allow.

    Attributes:
        device: The sensor, or None.
        stuck: Whether a line is held low.
        trace: Set to a list to record the bus: S start, [aa] address byte, a acknowledged, n not, xx byte written,
            rxx byte read, N last byte read, P stop.
        clocks: Clock pulses so far.
    """

    __slots__ = ("_counted", "_poured", "_told", "clocks", "device", "stuck", "trace")

    def __init__(self) -> None:
        self.device: I2CDevice | None = None
        self.stuck = False
        self.trace: list[str] | None = None
        self.clocks = 0
        self._poured: tuple[bytes, int] | None = None
        self._told = self._counted = 0

    def acknowledges(self, address: int) -> bool:
        """Whether a device acknowledges the 8-bit `address`, read or write."""
        return self.device is not None and self.device.address == address & 0xFE

    def probe(self, address: int) -> None:
        """Address a device that does not acknowledge."""
        self._record(("S", f"[{address:02x}]n", "P"), bytes_moved=1, extra_clocks=1)

    def transfer(self, message: bytes, rx_size: int) -> bytes:
        """Write `message` (address first), then read `rx_size` bytes without a stop at the end."""
        device = self.device
        if device is None:
            return b""
        address, data = message[0], message[1:]
        device.write(data)
        tokens = ["S", f"[{address:02x}]a", *(f"{byte:02x}" for byte in data), "P"]
        if not rx_size:
            self._record(tokens, bytes_moved=len(message), extra_clocks=1)
            return b""
        received = device.read(rx_size)
        tokens += ["S", f"[{address | 1:02x}]a", *(f"r{byte:02x}" for byte in received), "N"]
        self._record(tokens, bytes_moved=len(message) + 1 + rx_size, extra_clocks=3)
        return received

    def pour_out(self, message: bytes, now_ms: int) -> None:
        """Start a message that never ends in a stop; `settle` computes its progress."""
        self._poured = (message, now_ms)

    def settle(self, now_ms: int) -> None:
        """Add the part of such a message that was sent by `now_ms` to the trace."""
        if self._poured is None:
            return
        message, started_ms = self._poured
        steps = int((now_ms - started_ms + 1) * STEPS_PER_MS) - FRAME_STEPS
        count, rest = divmod(max(steps, 0), TX_STEPS)
        tokens = ["S", f"[{message[0]:02x}]a", *(f"{byte:02x}" for byte in message[1:count])]
        clocks = ADDRESS_CLOCKS * min(count, len(message))
        if count < len(message):
            clocks += min(rest // _CLOCK_STEPS, ADDRESS_CLOCKS)
        self._record(tokens[self._told : count + 1], 0, clocks - self._counted)
        self._told, self._counted = min(count + 1, len(tokens)), clocks

    def _record(self, tokens: Sequence[str], bytes_moved: int, extra_clocks: int) -> None:
        self.clocks += ADDRESS_CLOCKS * bytes_moved + extra_clocks
        if self.trace is not None:
            self.trace.extend(tokens)
