"""A handle of the loader: an open file, a search, or nothing. Source: docs/firmware.md section 5."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto

from sim_backend.firmware.files.flash import SECTOR, File


class Use(Enum):
    """Use of a handle."""

    FREE = auto()
    READ = auto()
    EXECUTE = auto()
    WRITE = auto()
    SEARCH = auto()


class Handle:
    """One entry of the table.

    Attributes:
        use: See `Use`.
        file: The open file.
        source: The file that is read; a program's handle continues with the last one that it was used for.
        position: Next byte of it to read.
        end: Number of its bytes that can be read.
        overrun: Whether more was written than announced.
        name: What the last look-up looked for; every look-up uses a handle, and no use clears it.
        matches: Test of that look-up.
        index: Directory entry that the last look-up found, `_NOWHERE` if none.
        slot: Number of its write buffer.
    """

    __slots__ = ("end", "file", "index", "matches", "name", "overrun", "position", "slot", "source", "use")

    def __init__(self) -> None:
        self.use = Use.FREE
        self.file: File | None = None
        self.source = File("", 0)
        self.position = self.end = self.slot = 0
        self.overrun = False
        self.name = ""
        self.matches: Callable[[str], bool] = lambda _: True
        self.index = 0

    def open(self, use: Use, file: File) -> None:
        """Begin to read, execute or write a file; a write continues after its data."""
        self.use, self.file, self.overrun = use, file, False
        if use != Use.EXECUTE:
            self.source, self.end = file, file.data_size
            self.position = len(file.content) if use == Use.WRITE else 0
        if use == Use.WRITE:
            file.begin_writing()

    def read(self, size: int) -> bytes:
        """Read on; bytes that were not written to the flash are FF."""
        start, self.position = self.position, min(self.position + size, self.end)
        return bytes(self.source.content[start : self.position]).ljust(self.position - start, b"\xff")

    def leave_written(self, file: File) -> None:
        """Leave a file that was written: as many bytes can be read as are missing, from its last page on.

        That page of a download is not in the flash then.
        """
        written = len(file.content)
        pages = (file.content_at + written) % SECTOR
        self.source, self.position = file, max(self.position, written - pages)
        self.end = self.position + file.announced - written
        if written < file.size and not file.appendable:
            del file.content[self.position :]
