"""The flash memory: files and the sectors they take. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

SECTOR = 256
_HEADER = 36
_POINTER = 2
_ALIGNMENT = 4

SETTINGS = "NVConfig.sys"
"""The file the firmware makes at its first boot."""


def capacity(sectors: int) -> int:
    """Bytes one file can have in so many sectors: its header and a pointer to each further sector take their part."""
    if not sectors:
        return 0
    pointers = -(-_POINTER * (sectors - 1) // _ALIGNMENT) * _ALIGNMENT
    return sectors * SECTOR - _HEADER - pointers


def sectors_for(size: int) -> int:
    """Sectors a file of `size` bytes takes."""
    sectors = max(1, (size + _HEADER) // SECTOR)
    while capacity(sectors) < size:
        sectors += 1
    return sectors


@dataclass(eq=False)
class File:
    """A file.

    Attributes:
        name: At most 19 characters, as given at its creation.
        size: Bytes reserved.
        appendable: Whether it is a data file, which can grow up to `size`.
        content: What was written.
        sectors: Numbers of the sectors it takes.
        data_size: Bytes that can be read; set when the file is closed.
    """

    name: str
    size: int
    appendable: bool = False
    content: bytearray = field(default_factory=bytearray)
    sectors: list[int] = field(default_factory=list)
    data_size: int = 0


class Flash:
    """Files, newest first, and free sectors; it keeps both when the brick is switched off.

    Attributes:
        files: The directory.
        limit: Most entries of the directory.
    """

    def __init__(self, sectors: int, limit: int, settings: bytes) -> None:
        self.limit = limit
        self.files: list[File] = []
        self._total = sectors
        self._used: set[int] = set()
        first = File(SETTINGS, len(settings), content=bytearray(settings), data_size=len(settings))
        self.reserve(first, contiguous=True)
        self.files.append(first)

    @property
    def free(self) -> int:
        """Size of the largest file that would fit."""
        return capacity(self._total - len(self._used))

    def find(self, matches: Callable[[str], bool], start: int = 0) -> int:
        """Number of the next file from `start` on whose name matches; the count of files if there is none."""
        for number in range(start, len(self.files)):
            if matches(self.files[number].name):
                return number
        return len(self.files)

    def reserve(self, file: File, *, contiguous: bool) -> bool:
        """Take sectors for `file`; false if there are not enough, or not enough in one piece."""
        count = sectors_for(file.size)
        free = [sector for sector in range(self._total) if sector not in self._used]
        for start in range(len(free) - count + 1):
            chosen = free[start : start + count]
            if not contiguous or chosen[-1] - chosen[0] == count - 1:
                file.sectors = chosen
                self._used.update(chosen)
                return True
        return False

    def shrink(self, file: File) -> None:
        """Reserve no more for a data file than it holds."""
        file.size = len(file.content)
        keep = sectors_for(file.size)
        self._used.difference_update(file.sectors[keep:])
        file.sectors = file.sectors[:keep]

    def release(self, file: File) -> None:
        """Give the file's sectors back, and with them those of all downloads: only the directory is looked at."""
        file.sectors = []
        self._used = {sector for other in self.files for sector in other.sectors}

    def power_up(self) -> None:
        """Forget what was under way when the brick was switched off: downloads, and data not yet closed."""
        self._used = {sector for file in self.files for sector in file.sectors}
        for file in self.files:
            del file.content[file.data_size :]

    def erase(self) -> None:
        """Delete everything, the settings too."""
        self.files.clear()
        self._used.clear()
