"""The bytes of the flash memory, written in sectors. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

from collections.abc import Callable

SECTOR = 256
POINTER = 2
"""Bytes of a sector's number."""

_CHIP = range(0x100000, 0x140000)
"""Addresses of the chip; the first sectors have the firmware, the last ones the directory."""
ERASED, WORD = b"\xff", 4


def sector_of(address: int) -> int:
    """Return the number of the sector of an address."""
    return (address & ~_CHIP.start) // SECTOR


def address_of(sector: int) -> int:
    """Return the address of a sector; numbers that no sector has are addresses outside of the flash."""
    return sector * SECTOR | _CHIP.start


def is_in_chip(address: int) -> bool:
    """Return whether the firmware takes an address for one of the chip."""
    return address & ~_CHIP.start <= len(_CHIP)


def sector_start(address: int) -> int:
    """Return the address of the first byte of an address's sector."""
    return address // SECTOR * SECTOR


class FlashMemory:
    """The sectors for files.

    Attributes:
        sectors: Their numbers.
        capacity: Number of their bytes.
        on_write: Called after each change.
    """

    def __init__(self, start: int, sectors: int) -> None:
        """Make erased sectors.

        Args:
            start: Address of the first one.
            sectors: How many there are.
        """
        self.sectors = range(sector_of(start), sector_of(start) + sectors)
        self.on_write: Callable[[], None] = lambda: None
        self.capacity = SECTOR * sectors
        self._start = start
        self._bytes = bytearray(ERASED * self.capacity)

    def read(self, address: int, size: int) -> bytes:
        """Return bytes; others of the chip are as if erased, and 0 outside of it, as on the bench."""
        at = address - self._start
        before = min(max(-at, 0), size)
        content = self._bytes[max(at, 0) : max(at + size, 0)]
        other = ERASED if address in _CHIP else b"\0"
        return (other * before + content).ljust(size, other)

    def number(self, address: int) -> int:
        """Return the sector's number that is stored at an address."""
        return int.from_bytes(self.read(address, POINTER), "little")

    def write(self, address: int, content: bytes | bytearray) -> None:
        """Write words at the beginning of an address's sector; the rest keeps its bytes, as on the bench."""
        at = sector_start(address - self._start)
        if 0 <= at < len(self._bytes):
            self._bytes[at : at + len(content)] = content
            self.on_write()

    def erase(self) -> None:
        """Erase all sectors."""
        self._bytes[:] = ERASED * len(self._bytes)
        self.on_write()
