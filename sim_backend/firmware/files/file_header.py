"""Files as their headers in the flash describe them. Source: docs/firmware.md section 5, "File system".

A header has the name, the address of the first byte, two sizes, the kind, and a table of the sectors after the first.
The table continues in further sectors; the last entry of each is the number of the next.
"""

from __future__ import annotations

import struct
from enum import IntFlag

from sim_backend.firmware.files.flash_memory import POINTER, SECTOR, FlashMemory, address_of, is_in_chip, sector_start
from sim_backend.firmware.files.names import pack_name, unpack_name

_FIXED = struct.Struct("<20s3I2xH")
FIXED_SIZE = _FIXED.size
"""Bytes of a header before the table of sectors."""
_NAME = slice(0, 20)
_SIZE = slice(24, 28)
_DATA_SIZE = slice(28, 32)


class Kind(IntFlag):
    """What a file is."""

    SYSTEM = 1
    DATA = 2
    """It can grow up to its size."""
    LINEAR = 4
    """It is one block; programs and pictures must be."""
    SCATTERED = 8


def fixed_header(name: str, start: int, size: int, kind: Kind) -> bytes:
    """Return the part of a new file's header that is before the table; a data file has no data yet."""
    return _FIXED.pack(pack_name(name), start, size, 0 if kind & Kind.DATA else size, kind)


def links_sector(at: int) -> bool:
    """Return whether the entry at an address, or at a place in a header, is the number of the table's next sector."""
    return (at + POINTER) % SECTOR == 0


class File:
    """A file; other files or data may have been written over its header.

    Attributes:
        address: Of the header.
        name: As given at creation.
        start: Address of the first byte.
        size: Reserved bytes.
        data_size: Bytes that can be read.
        kind: See `Kind`.
    """

    __slots__ = ("_memory", "address", "data_size", "kind", "name", "size", "start")

    def __init__(self, memory: FlashMemory, address: int) -> None:
        self._memory, self.address = memory, address
        name, self.start, self.size, self.data_size, kind = _FIXED.unpack(memory.read(address, FIXED_SIZE))
        self.name, self.kind = unpack_name(name), Kind(kind & 0xF)

    @property
    def content(self) -> bytes:
        """The bytes that can be read, as far as the flash has room for them."""
        cursor = Cursor(self._memory)
        cursor.begin(self)
        return cursor.read(self.data_size)

    @property
    def block(self) -> bytes:
        """The same of a file that is one block."""
        return self._memory.read(self.start, min(self.data_size, self._memory.capacity))

    def rename(self, name: str) -> None:
        """Write another name into the header."""
        self._change(_NAME, pack_name(name))

    def resize(self, size: int, address: int) -> None:
        """Write the header with another size to an address, where that of another file may be."""
        self._change(_SIZE, size.to_bytes(4, "little"), address)

    def set_data_size(self, size: int) -> None:
        """Write into the header how much can be read."""
        self._change(_DATA_SIZE, (size & 0xFFFFFFFF).to_bytes(4, "little"))

    def _change(self, field: slice, value: bytes, address: int | None = None) -> None:
        page = bytearray(self._memory.read(self.address, SECTOR))
        page[field] = value
        self._memory.write(self.address if address is None else address, page)


class Cursor:
    """A place in a file.

    Attributes:
        at: Address of the next byte.
        entry: Address of the table's entry for the next sector.
    """

    __slots__ = ("_memory", "at", "entry")

    def __init__(self, memory: FlashMemory) -> None:
        self._memory = memory
        self.at = self.entry = 0

    def begin(self, file: File) -> None:
        """Go to a file's first byte."""
        self.at, self.entry = file.start, file.address + FIXED_SIZE

    def next_sector(self) -> None:
        """Go to the file's next sector."""
        memory = self._memory
        if links_sector(self.entry):
            self.entry = address_of(memory.number(self.entry))
        self.at = address_of(memory.number(self.entry)) if is_in_chip(self.entry) else 0
        self.entry += POINTER

    def read(self, size: int) -> bytes:
        """Read on, as far as the flash has room: data in the place of a header may be sizes of gigabytes."""
        content, size = bytearray(), min(size, self._memory.capacity)
        while len(content) < size:
            piece = self._memory.read(self.at, min(size - len(content), SECTOR - self.at % SECTOR))
            content += piece
            self.at += len(piece)
            if self.at % SECTOR == 0:
                self.next_sector()
        return bytes(content)

    def find(self, file: File, place: int) -> None:
        """Go to a byte of a file, as the firmware finds the end of the data.

        If the byte is the first of a sector after the second, the firmware goes to the sector after the right one.
        """
        self.begin(file)
        in_first = SECTOR - file.start % SECTOR
        if place <= in_first:
            self.at += place
            return
        place -= in_first
        for _ in range(min(place, self._memory.capacity) // SECTOR + 1):
            self.next_sector()
        self.at += place - (place - 1) // SECTOR * SECTOR

    @property
    def sector(self) -> int:
        """Address of the sector of the next byte."""
        return sector_start(self.at)
