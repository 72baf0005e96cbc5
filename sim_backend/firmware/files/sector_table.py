"""The free sectors of the flash. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from sim_backend.firmware.files.file_header import FIXED_SIZE, File, Kind, fixed_header, links_sector
from sim_backend.firmware.files.flash_memory import POINTER, SECTOR, FlashMemory, address_of, sector_of

_ALIGNMENT = 4
_CHIP_SECTORS = 1024
_NO_SECTOR = 0xFFFF


def free_bytes(sectors: int) -> int:
    """Free flash that the firmware reports for `sectors` free sectors.

    The header of a file with that many sectors is rounded to a multiple of four bytes: up, but down if only one pointer
    reaches into the header's last sector.
    """
    if not sectors:
        return 0
    header = FIXED_SIZE + POINTER * (sectors - 1)
    rest = header % _ALIGNMENT
    if rest:
        header += -rest if header % SECTOR == POINTER else _ALIGNMENT - rest
    return sectors * SECTOR - header


def sectors_for(size: int) -> int:
    """Return the number of sectors counted for a new file: the first has the header and pointers to the others."""
    return max(1, -(-(size + FIXED_SIZE - POINTER) // (SECTOR - POINTER)))


class NewFile(NamedTuple):
    """A file that has sectors: the address of its header, that of its first byte, and the header."""

    address: int
    start: int
    header: bytes


class SectorTable:
    """The sectors that files have, as counted the last time, and those of newer files."""

    def __init__(self, memory: FlashMemory) -> None:
        self._memory = memory
        self._used: set[int] = set()
        self._free = len(memory.sectors)

    @property
    def free(self) -> int:
        """Free bytes, as the firmware reports them."""
        return free_bytes(self._free)

    def allocate(self, name: str, size: int, kind: Kind) -> NewFile | None:
        """Take sectors for a file; return None without the first of them, or without one block if it must be one.

        Of the others it has those that are free. The header is rounded up, for which it may have one sector more than
        is counted until the next count.
        """
        count = sectors_for(size)
        first = self._first(count if kind & Kind.LINEAR else 1)
        if first is None:
            return None
        self._free -= count
        header_size = -(-(FIXED_SIZE + POINTER * (count - 1)) // _ALIGNMENT) * _ALIGNMENT
        pages, in_page = -(-header_size // SECTOR), header_size % SECTOR
        table = [_NO_SECTOR] * ((pages * SECTOR - FIXED_SIZE) // POINTER)
        links = [place for place in range(len(table)) if links_sector(FIXED_SIZE + POINTER * place)]
        sectors = self._taken(first)
        last = next(sectors)
        for link, sector in zip(links[: pages - 1], sectors, strict=False):
            table[link] = last = sector
        start = address_of(last) + (in_page or SECTOR)
        body = -(-max(0, size - SECTOR + in_page) // SECTOR)
        if body and not in_page:
            start = address_of(next(sectors, last + 1))
        places = [place for place in range(len(table)) if place not in links]
        for place, sector in zip(places[:body], sectors, strict=False):
            table[place] = sector
        packed = b"".join(number.to_bytes(POINTER, "little") for number in table)
        return NewFile(address_of(first), start, fixed_header(name, start, size, kind) + packed)

    def count(self, files: Iterable[File]) -> None:
        """Find the used sectors from the headers of the files; those of downloads become free."""
        used = self._used = set[int]()
        for file in files:
            used |= {sector_of(file.start), sector_of(file.address)}
            used.update(self._listed(file))
        self._free = sum(sector not in used for sector in self._memory.sectors)

    def _listed(self, file: File) -> Iterator[int]:
        """Find the sectors in a header's table as far as the size needs them.

        Data in the place of a header may be a table without an end; the sectors repeat themselves then.
        """
        covered, entry, pages = SECTOR - file.start % SECTOR, file.address + FIXED_SIZE, set[int]()
        while covered < file.size and (sector := self._memory.number(entry)) < _CHIP_SECTORS:
            yield sector
            if not links_sector(entry):
                entry += POINTER
                covered += SECTOR
            elif sector in pages:
                return
            else:
                pages.add(sector)
                entry = address_of(sector)

    def _first(self, count: int) -> int | None:
        """Return the first of that many free sectors in a row."""
        row = 0
        for sector in self._memory.sectors:
            row = 0 if sector in self._used else row + 1
            if row == count:
                return sector - count + 1
        return None

    def _taken(self, first: int) -> Iterator[int]:
        """Take free sectors from `first` on."""
        for sector in range(first, self._memory.sectors.stop):
            if sector not in self._used:
                self._used.add(sector)
                yield sector
