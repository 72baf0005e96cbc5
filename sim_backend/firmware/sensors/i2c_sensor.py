"""The sensor's end of the I2C bus of an input port: it follows the two wires. Source: docs/firmware.md section 7."""

from __future__ import annotations

from enum import Enum, auto
from typing import Protocol, runtime_checkable

BYTE_BITS = 8


@runtime_checkable
class I2CDevice(Protocol):
    """A digital sensor."""

    @property
    def address(self) -> int:
        """Its address in the 8-bit write form, such as 0x02."""

    def write(self, data: bytes) -> None:
        """Receive the bytes after the address."""

    def read(self, size: int) -> bytes:
        """Return `size` bytes, or fewer but at least one; the others are read later."""

    def give_back(self, count: int) -> None:
        """Restore the last `count` bytes of the last read, which were not sent because it was cut short."""


class _Phase(Enum):
    IDLE = auto()
    ADDRESSED = auto()
    RECEIVING = auto()
    SENDING = auto()


_IDLE, _ADDRESSED, _RECEIVING, _SENDING = _Phase


class SensorEnd:
    """At most one device, as LEGO's cables allow, and a record of the bus.

    Attributes:
        device: The sensor, or None.
        acknowledges: Whether it acknowledges its address.
        acknowledges_data: Whether it acknowledges bytes other than its address.
        pulls_data: Whether the sensor pulls the data line low.
        trace: Set to a list to record the bus: S start, [aa] address byte, a acknowledged, n not, xx byte written,
            rxx byte read, N last byte read, P stop.
        clocks: Rises of the clock line so far.
    """

    def __init__(self) -> None:
        self.device: I2CDevice | None = None
        self.acknowledges, self.acknowledges_data, self.pulls_data = True, True, False
        self.trace: list[str] | None = None
        self.clocks = self._wanted = 0
        self._address: int | None = None
        self._phase = _IDLE
        self._bits = self._byte = self._byte_sent = 0
        self._selected = False
        self._received = bytearray()
        self._answer = bytearray()

    def connect(self, device: I2CDevice | None) -> None:
        """Plug in a device, or none."""
        if device is None:
            self._finish()
            self._phase = _IDLE
        elif device is not self.device:
            self._answer.clear()
        self.device = device
        self.prepare(self._wanted)

    def prepare(self, wanted: int) -> None:
        """Let the device decide whether it answers the next message, and prepare that many bytes for the firmware."""
        self._address, self._wanted = None if self.device is None else self.device.address, wanted

    def start(self) -> None:
        """Expect an address: the data line fell while the clock line was high."""
        self._record("S")
        self._finish()
        self._phase, self._bits, self._byte = _ADDRESSED, 0, 0

    def stop(self) -> None:
        """End the message: the data line rose while the clock line was high."""
        self._record("P")
        self._finish()
        self._phase = _IDLE

    def rise(self, data: bool) -> None:
        """Take a bit: the clock line rises."""
        self.clocks += 1
        if self._phase is _IDLE:
            return
        self._bits += 1
        if self._bits <= BYTE_BITS:
            self._byte = self._byte << 1 | data
        elif self._phase is _SENDING and data:
            self._record("N")
            self._phase = _IDLE

    def fall(self) -> None:
        """Output a bit, or the acknowledge after eight: the clock line falls."""
        if self._phase is _IDLE:
            self.pulls_data = False
            return
        if self._bits == BYTE_BITS:
            self.pulls_data = self._acknowledge()
            return
        if self._bits > BYTE_BITS:
            self._next_byte()
        sends = self._phase is _SENDING and self.device is not None
        self.pulls_data = sends and not self._byte_sent >> BYTE_BITS - 1 - self._bits & 1

    def _acknowledge(self) -> bool:
        """Handle the byte that is complete."""
        if self._phase is _SENDING:
            return False
        if self._phase is _ADDRESSED:
            self._selected = self.acknowledges and self._address == self._byte & 0xFE
            self._record(f"[{self._byte:02x}]{'a' if self._selected else 'n'}")
            return self._selected
        self._record(f"{self._byte:02x}")
        self._received.append(self._byte)
        return self.device is not None and self.acknowledges_data

    def _next_byte(self) -> None:
        if self._phase is _ADDRESSED:
            reads, self._answer = self._byte & 1, bytearray()
            self._phase = _IDLE if not self._selected else _SENDING if reads else _RECEIVING
        self._bits = self._byte = 0
        if self._phase is _SENDING:
            if not self._answer and self.device is not None:
                self._answer = bytearray(self.device.read(max(self._wanted, 1)))
            self._byte_sent = self._answer.pop(0) if self._answer else 0xFF
            self._record(f"r{self._byte_sent:02x}")

    def _finish(self) -> None:
        """Tell the device what it has received, or has not sent."""
        self.pulls_data = False
        if self._answer and self.device is not None:
            self.device.give_back(len(self._answer))
        self._answer.clear()
        if self._received and self.device is not None:
            self.device.write(bytes(self._received))
        self._received.clear()

    def _record(self, token: str) -> None:
        if self.trace is not None:
            self.trace.append(token)
