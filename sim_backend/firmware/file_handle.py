"""A handle of the loader: an open file, a search, or nothing. Source: docs/firmware.md section 5."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto

from sim_backend.firmware.flash import File


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
        position: Next byte to read; a program's handle goes on where its last file was left.
        end: Number of bytes that can be read, of that file.
        overrun: Whether more was written than announced.
        name: Name or pattern of the last look-up, in lower case; every look-up uses a handle, and none forgets it.
        matches: Test of that look-up.
        index: Directory entry that the last look-up found, `_NOWHERE` if none.
        keep: Whether it stays open when the USB cable is pulled.
        slot: Number of its write buffer.
    """

    __slots__ = ("end", "file", "index", "keep", "matches", "name", "overrun", "position", "slot", "use")

    def __init__(self) -> None:
        self.use = Use.FREE
        self.file: File | None = None
        self.position = self.end = self.slot = 0
        self.overrun = self.keep = False
        self.name = ""
        self.matches: Callable[[str], bool] = lambda _: True
        self.index = 0
