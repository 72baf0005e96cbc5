"""The tables of devices and connections in the Comm map. Source: docs/firmware.md sections 4 and 8.5."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.iomap import COMM

CONTACTS, CONNECTIONS = 30, 4
"""Sizes of the tables."""
_CONNECTION_SIZE = 47

FREE = 0xFF
"""Handle of a connection that there is not."""

_FOUND, _KNOWN, _AWAY = 0x01, 0x02, 0x80
"""Bits of a device's status."""


class RadioTables:
    """What the tables say, which telegrams can write; they are empty at first.

    Args:
        comm: The Comm map, from the tables on.
    """

    def __init__(self, comm: memoryview) -> None:
        self._comm, self._begin = comm, COMM.field("DeviceName").offset
        self.clear()

    def devices(self, *, known: bool) -> Sequence[int]:
        """Return the numbers of the devices that are known, or of these and those that were found."""
        bits = _KNOWN if known else _KNOWN | _FOUND
        return [number for number in range(CONTACTS) if self._byte("DeviceStatus", number) & bits]

    def connected(self, number: int) -> bool:
        """Return whether a connection has a name."""
        return number < CONNECTIONS and self._byte("ConnectionName", number) != 0

    def handle(self, number: int) -> int:
        """Return the handle of a connection; `FREE` if there is none."""
        return self._byte("ConnectionHandle", number)

    @property
    def handles(self) -> Sequence[int]:
        """Return the handles of the connections that have a name."""
        return [self.handle(number) for number in range(CONNECTIONS) if self.connected(number)]

    def remove(self, number: int) -> None:
        """Forget a device, whose name stays."""
        self._comm[self._place("DeviceStatus", number)] = 0

    def begin_search(self) -> None:
        """Forget the devices that were only found, and take those that are known as away."""
        for number in self.devices(known=False):
            place = self._place("DeviceStatus", number)
            self._comm[place] = _KNOWN | _AWAY if self._comm[place] & _KNOWN else 0

    def end(self, handle: int) -> None:
        """Clear the first connection with a handle."""
        numbers = [number for number in range(CONNECTIONS) if self.handle(number) == handle]
        if not numbers:
            return
        number = numbers[0]
        begin = self._place("ConnectionName", number)
        self._comm[begin : begin + _CONNECTION_SIZE] = bytes(_CONNECTION_SIZE)
        self._comm[self._place("ConnectionHandle", number)] = FREE

    def clear(self) -> None:
        """Forget all devices and connections; only the first connection has a handle."""
        size = self._place("ConnectionName", 0) + CONNECTIONS * _CONNECTION_SIZE
        self._comm[:size] = bytes(size)
        for number in range(1, CONNECTIONS):
            self._comm[self._place("ConnectionHandle", number)] = FREE

    def _byte(self, name: str, index: int) -> int:
        return self._comm[self._place(name, index)]

    def _place(self, name: str, index: int) -> int:
        return COMM.field(name, index).offset - self._begin
