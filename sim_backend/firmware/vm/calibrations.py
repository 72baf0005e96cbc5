"""Calibrations of sensors in a running program: an array in its memory pool.

Source: docs/firmware.md section 8.4.
"""

from __future__ import annotations

import struct

from sim_backend.firmware.vm.memory import Memory

_RANGE = struct.Struct("<hh")
_SIZE = 24
"""Bytes of a calibration: lowest and highest raw value, then its name, which ends with a zero."""

_NAME_LIMIT = _SIZE - _RANGE.size - 1


class Calibrations:
    """The calibrations, none at first."""

    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self._array: int | None = None

    def load(self, name: bytes, data: bytes) -> None:
        """Store the calibration of a file; without exactly both values in it they are 0.

        Raises:
            OutOfMemory: The pool is full.
        """
        self.store(name, *(_RANGE.unpack(data) if len(data) == _RANGE.size else (0, 0)))

    def store(self, name: bytes, low: int, high: int) -> None:
        """Change a calibration, or append it. After its name it keeps the former content of the memory.

        Raises:
            OutOfMemory: The pool is full.
        """
        if self._array is None:
            self._array = self._memory.new_array(_SIZE)
        entries = self._entries()
        number = next((i for i, entry in enumerate(entries) if _name(entry) == name), len(entries))
        if number == len(entries):
            self._memory.resize(self._array, number + 1)
        at = self._memory.array(self._array).offset + number * _SIZE
        self._memory.write(at, _RANGE.pack(low, high) + name[:_NAME_LIMIT] + b"\0")

    def find(self, name: bytes) -> tuple[int, int] | None:
        """Return the lowest and highest raw value of a calibration, or None."""
        found = (entry for entry in self._entries() if _name(entry) == name)
        return next((_RANGE.unpack_from(entry) for entry in found), None)

    def _entries(self) -> list[bytes]:
        if self._array is None:
            return []
        data = self._memory.bytes_of(self._array)
        return [data[at : at + _SIZE] for at in range(0, len(data), _SIZE)]


def _name(entry: bytes) -> bytes:
    return entry[_RANGE.size :].split(b"\0")[0]
