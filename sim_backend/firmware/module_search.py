"""The look-up of modules by name: the firmware has one at a time. Source: docs/firmware.md section 5 (0x90)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from firmware_protocol.status import Status
from sim_backend.firmware.io_map import LiveMap
from sim_backend.firmware.names import NAME_SIZE, matcher

_MARK_BEHIND = 3
"""Where, behind the field of the pattern, the mark of an open listing is."""


class ModuleSearch:
    """The one listing of modules, for telegrams and programs. At power-on it is one of all modules, and not open."""

    def __init__(self, maps: Sequence[LiveMap]) -> None:
        """Take the maps in the order of the listing."""
        self._maps = maps
        self._is_open = False
        self._found: Iterator[LiveMap] = iter(maps)

    def first(self, pattern: str) -> LiveMap | Status:
        """Open a listing and return its first module, or why there is none; then it stays open, too.

        The firmware copies the pattern in upper case to a field of 20 bytes, however long it is: the next byte is the
        number of the module to begin with, and the zero behind the pattern may close the listing. Long patterns but
        those for all modules find nothing, or (``*.mod``) are cut.
        """
        if self._is_open:
            return Status.NO_MORE_HANDLES
        matches = matcher(pattern)
        rest = pattern.encode("latin-1").upper()[NAME_SIZE:] if "*.*" in pattern else b""
        self._found = iter([live for live in self._maps[rest[0] if rest else 0 :] if matches(live.layout.name)])
        self._is_open = len(rest) != _MARK_BEHIND
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
