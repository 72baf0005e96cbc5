"""The look-up of modules by name: the firmware has one at a time. Source: docs/firmware.md section 5 (0x90)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import NAME_SIZE, looked_for, matcher
from sim_backend.firmware.live_map import LiveMap

_MARK = 3
"""Where, after the field of the pattern, the mark of an open listing is."""


class ModuleSearch:
    """The only listing of modules, for telegrams and programs. At power-on it lists all modules, and is not open."""

    def __init__(self, maps: Sequence[LiveMap], loader: Loader, free_flash_at: int) -> None:
        """Make the module.

        Args:
            maps: The maps in the order of the listing.
            loader: Its free flash is after the pattern, too.
            free_flash_at: Where that is.
        """
        self._maps, self._loader, self._free_flash_at = maps, loader, free_flash_at
        self._is_open = False
        self._found: Iterator[LiveMap] = iter(maps)

    def first(self, pattern: str) -> LiveMap | Status:
        """Open a listing and return its first module, or why there is none; even then the listing stays open.

        The firmware copies what it looks for to a field of 20 bytes, however long it is, and over the number of the
        module to begin with, the mark, and the free flash after it. With ``*.*`` it copies the pattern as it is, and
        the final zero.
        """
        if self._is_open:
            return Status.NO_MORE_HANDLES
        text, matches = pattern.encode("latin-1") + b"\0", matcher(pattern)
        after = (text if b"*.*" in text else looked_for(pattern).encode("latin-1").upper())[NAME_SIZE:]
        self._found = iter([live for live in self._maps[after[0] if after else 0 :] if matches(live.layout.name)])
        self._is_open = after[_MARK : _MARK + 1] != b"\0"
        free = bytearray(self._loader.free_flash.to_bytes(4, "little"))
        over = after[self._free_flash_at :][: len(free)]
        free[: len(over)] = over
        self._loader.free_flash = int.from_bytes(free, "little")
        return self.following()

    def following(self) -> LiveMap | Status:
        """Return the next module of the last listing, also of one that was closed."""
        return next(self._found, Status.MODULE_NOT_FOUND)

    def close(self) -> None:
        """Allow the next listing."""
        self._is_open = False

    def only(self, pattern: str) -> LiveMap | Status:
        """Look a module up as a program does, which closes the listing, regardless of its opener."""
        found = self.first(pattern)
        self.close()
        return found
