"""The flash memory: files and their sectors. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from sim_backend.firmware.files.names import matcher

SECTOR = 256
_HEADER = 36
_POINTER = 2
_ALIGNMENT = 4

SETTINGS = "NVConfig.sys"
"""File that the firmware creates at its first boot."""

SETTING_BITS, VOLUME_SHIFT = 7, 4
"""In the one byte of the settings of 1.05 the sleep time-out has the lowest bits, the volume some above."""
_LOUDEST, _LONGEST = 4, 5
"""The greatest of each that it accepts."""


def free_bytes(sectors: int) -> int:
    """Free flash that the firmware reports for `sectors` free sectors.

    The header of a file with that many sectors is rounded to a multiple of four bytes: up, but down if only one pointer
    reaches into the header's last sector.
    """
    if not sectors:
        return 0
    header = _HEADER + _POINTER * (sectors - 1)
    rest = header % _ALIGNMENT
    if rest:
        header += -rest if header % SECTOR == _POINTER else _ALIGNMENT - rest
    return sectors * SECTOR - header


def sectors_for(size: int) -> int:
    """Return the number of sectors counted for a new file: the first has the header and pointers to the others."""
    return max(1, -(-(size + _HEADER - _POINTER) // (SECTOR - _POINTER)))


def _sectors_taken(size: int) -> int:
    """Return the number of sectors of a file: its header is rounded up, for which its last sector may be too small."""
    sectors = sectors_for(size)
    return sectors + (sectors * SECTOR - _rounded(_header(sectors)) < size)


def _header(sectors: int) -> int:
    return _HEADER + _POINTER * (sectors - 1)


def _rounded(header: int) -> int:
    return -(-header // _ALIGNMENT) * _ALIGNMENT


def _is_kept(content: bytes, settings: bytes) -> bool:
    """Return whether the firmware keeps a settings file: newer versions look at its format, 1.05 at its values."""
    if not content or len(settings) > 1:
        return content[:1] == settings[:1]
    volume, sleep = content[0] >> VOLUME_SHIFT & SETTING_BITS, content[0] & SETTING_BITS
    return volume <= _LOUDEST and sleep <= _LONGEST


@dataclass(eq=False)
class File:
    """A file.

    Attributes:
        name: At most 19 characters, as given at creation.
        size: Reserved bytes.
        appendable: Whether it is a data file, which can grow up to `size`.
        linear: Whether it was created as one block; programs and pictures must be.
        content: Written bytes.
        sectors: Numbers of its sectors.
        data_size: Readable bytes; of a data file set when it is closed.
        overlaid_by: A file whose header has overwritten this one's.
        announced: Its size when it was last opened for writing; 8D may shrink it meanwhile.
        reserved: The same of its sectors.
        named: The same of its name, which a program of 1.05 may change meanwhile.
    """

    name: str
    size: int
    appendable: bool = False
    linear: bool = False
    content: bytearray = field(default_factory=bytearray)
    sectors: list[int] = field(default_factory=list)
    data_size: int = 0
    overlaid_by: File | None = None
    announced: int = 0
    reserved: list[int] = field(default_factory=list)
    named: str = ""

    def begin_writing(self) -> None:
        """Keep the header in memory, as the firmware does for each file that is being written."""
        self.named, self.announced, self.reserved = self.name, self.size, self.sectors

    def renew_header(self) -> None:
        """Write the header that was kept to the flash."""
        self.overlaid_by = None
        self.name, self.size, self.sectors = self.named, self.announced, self.reserved

    @property
    def content_at(self) -> int:
        """Where its content begins, in bytes from the first sector; the header is rounded up."""
        return self.sectors[0] * SECTOR + _rounded(_header(len(self.sectors)))

    @property
    def first_page(self) -> int:
        """Number of its bytes that are written to the flash together with the beginning of its header."""
        return min(self.announced, max(0, SECTOR - _rounded(_header(len(self.reserved)))))

    @property
    def seen(self) -> File:
        """The file that a directory entry of this one shows."""
        return self if self.overlaid_by is None else self.overlaid_by.seen


class Flash:
    """Files, newest first, and free sectors; both survive power-off.

    Attributes:
        files: The directory.
        limit: Maximum number of entries.
    """

    def __init__(self, sectors: int, limit: int, settings: bytes) -> None:
        self.limit = limit
        self.files: list[File] = []
        self._total, self._settings = sectors, settings
        self._used: set[int] = set()
        self._uncounted = 0
        self.power_up()

    @property
    def free(self) -> int:
        """Free bytes, as the firmware reports them."""
        return free_bytes(self._total - len(self._used) + self._uncounted)

    def names_ending(self, extension: str) -> list[str]:
        """Return the files whose names end like that, in the order of the directory."""
        return [file.name for file in self.files if file.name.lower().endswith(extension)]

    def find(self, matches: Callable[[str], bool], start: int = 0) -> int:
        """Return the index of the next matching file from `start` on; the number of files if there is none."""
        for number in range(start, len(self.files)):
            if matches(self.files[number].name):
                return number
        return len(self.files)

    def reserve(self, file: File, *, contiguous: bool) -> bool:
        """Allocate sectors for `file`: one block if `contiguous`, else those that are free, even if it lacks some."""
        count = _sectors_taken(file.size)
        free = [sector for sector in range(self._total) if sector not in self._used]
        for start in range(len(free) - count + 1 if contiguous else min(1, len(free))):
            chosen = free[start : start + count]
            if not contiguous or chosen[-1] - chosen[0] == count - 1:
                file.sectors = chosen
                self._used.update(chosen)
                self._uncounted += len(chosen) - sectors_for(file.size)
                return True
        return False

    def shrink(self, file: File) -> None:
        """Shrink the reservation of a data file to its data, if it is greater, and free the sectors of all downloads.

        The header keeps its size, of which at most one sector more is counted than its end and the data need.
        """
        if not file.appendable or file.data_size == file.size:
            return
        header = _rounded(_header(len(file.sectors)))
        file.size = file.data_size
        keep = (header >= SECTOR) + max(1, -(-(header % SECTOR + file.size) // SECTOR))
        file.sectors = file.sectors[:keep]
        self.count()

    def power_up(self) -> None:
        """Discard incomplete downloads and unclosed data, and create the settings again, as at power-on."""
        self.count()
        for file in self.files:
            del file.content[file.data_size :]
        self.restore_settings()

    def restore_settings(self) -> bytes:
        """Return the settings; their file is created if it is missing, empty, or of another format."""
        settings, size = self._settings, len(self._settings)
        number = self.find(matcher(SETTINGS))
        if number < len(self.files):
            file = self.files[number]
            content = bytes(file.content[: file.data_size])
            if _is_kept(content, settings):
                return content[:size].ljust(size, b"\0")
            del self.files[number]
            self.count()
        file = File(SETTINGS, size, content=bytearray(settings), data_size=size)
        if self.reserve(file, contiguous=True):
            self.files.insert(0, file)
        return settings

    def count(self) -> None:
        """Find the used sectors from the directory, which lacks downloads, as after each deletion."""
        self._used = {sector for file in self.files for sector in file.sectors}
        self._uncounted = 0

    def erase(self) -> None:
        """Delete all files, including the settings."""
        self.files.clear()
        self._used.clear()
        self._uncounted = 0
