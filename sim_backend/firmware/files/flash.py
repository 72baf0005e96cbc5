"""The flash memory and its directory of files. Source: docs/firmware.md section 5, "File system".

A file is what its header in the flash says: where two files share sectors, each shows what was written there last.
"""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.files.file_header import File
from sim_backend.firmware.files.flash_memory import FlashMemory
from sim_backend.firmware.files.sector_table import SectorTable


class Flash:
    """The bytes and the directory, which survive power-off, and the free sectors, which are counted at power-on.

    Attributes:
        memory: The bytes.
        directory: Addresses of the headers, newest first.
        limit: Maximum number of entries.
        sectors: The free sectors.
    """

    def __init__(self, start: int, sectors: int, limit: int) -> None:
        """Make an empty flash.

        Args:
            start: Address of the first sector for files.
            sectors: Number of these sectors.
            limit: Maximum number of files.
        """
        self.memory, self.limit = FlashMemory(start, sectors), limit
        self.directory: list[int] = []
        self.sectors = SectorTable(self.memory)

    @property
    def free(self) -> int:
        """Free bytes, as the firmware reports them."""
        return self.sectors.free

    @property
    def files(self) -> list[File]:
        """The files of the directory."""
        return [File(self.memory, address) for address in self.directory]

    def names_ending(self, extension: str) -> list[str]:
        """Return the files whose names end like that, in the order of the directory."""
        return [file.name for file in self.files if file.name.lower().endswith(extension)]

    def find(self, matches: Callable[[str], bool], start: int = 0) -> int:
        """Return the index of the next matching file from `start` on; the number of files if there is none."""
        for number in range(start, len(self.directory)):
            if matches(self.file(number).name):
                return number
        return len(self.directory)

    def file(self, number: int) -> File:
        """Return the file of an entry; after the directory are zeros, on the bench also in place of the header."""
        return File(self.memory, self.directory[number] if number < len(self.directory) else 0)

    def count(self) -> None:
        """Find the used sectors from the directory, which lacks downloads, as after each deletion."""
        self.sectors.count(self.files)

    def erase(self) -> None:
        """Delete all files, and erase the flash."""
        self.directory.clear()
        self.memory.erase()
        self.count()
