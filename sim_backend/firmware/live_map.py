"""Live IO map of a module: declared variables on top of plain bytes.

A variable shows the bits of its value that fit its type; in the firmware it has no others.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any, NamedTuple

from firmware_protocol.iomap_layout import IOMap
from sim_backend.firmware.cint import fit

_RANGES = 32
"""Ranges of a map whose variables are remembered."""


class _View(NamedTuple):
    """A live variable; `put` is None if the firmware overwrites written values at once."""

    offset: int
    layout: struct.Struct
    get: Callable[[], Any]
    put: Callable[[Any], None] | None


class LiveMap:
    """The map of one module of one brick.

    Attributes:
        layout: Declaration of the map.
        size: Size in bytes.
    """

    def __init__(
        self,
        layout: IOMap,
        *,
        on_write: Callable[[], None] | None = None,
        memory: bytearray | None = None,
    ) -> None:
        """Make a map without live variables.

        Args:
            layout: See `LiveMap`.
            on_write: Called after each write.
            memory: The module's own bytes, if it has them; new ones by default.
        """
        self.layout = layout
        self.size = layout.size
        self._on_write = on_write
        self._views: list[_View] = []
        self._touched = lru_cache(_RANGES)(self._find)
        self._bytes = bytearray(self.size) if memory is None else memory

    def boot(self, size: int, presets: Mapping[int, bytes]) -> None:
        """Make the map as long as in this version of the firmware, and set bytes as its boot does, by offset."""
        self._bytes.extend(bytes(max(0, size - self.size)))
        self.size = size
        for offset, data in presets.items():
            self.store(offset, data)

    def preset(self, name: str, value: object, index: int = 0) -> None:
        """Set a variable as the firmware's boot does."""
        spot = self.layout.field(name, index)
        self._bytes[spot.offset : spot.offset + spot.size] = spot.encode(value)

    def bytes_from(self, name: str) -> memoryview:
        """Return the shared bytes of the map from a variable on; the size of the map cannot change after that."""
        return memoryview(self._bytes)[self.layout.field(name).offset :]

    def bind(self, owner: object, *, index: int = 0, **names: str) -> None:
        """Bind variables to attributes of `owner`: name in the firmware to name of the attribute."""
        for name, attribute in names.items():
            self._add(name, index, partial(getattr, owner, attribute), partial(setattr, owner, attribute))

    def show(self, owner: object, *, index: int = 0, **names: str) -> None:
        """Bind variables read-only: the firmware overwrites written values at once."""
        for name, attribute in names.items():
            self._add(name, index, partial(getattr, owner, attribute), None)

    def _add(self, name: str, index: int, get: Callable[[], Any], put: Callable[[Any], None] | None) -> None:
        spot = self.layout.field(name, index)
        self._views.append(_View(spot.offset, struct.Struct("<" + spot.wire.code), get, put))
        self._touched.cache_clear()

    def read(self, offset: int, size: int) -> bytes:
        """Read `size` bytes at `offset`; the caller has checked the range."""
        self._refresh(offset, offset + size)
        return bytes(self._bytes[offset : offset + size])

    def write(self, offset: int, data: bytes) -> None:
        """Write bytes; the caller has checked the range."""
        self.store(offset, data)
        if data:
            self.settle()

    def settle(self) -> None:
        """Tell the module that the map was written."""
        if self._on_write is not None:
            self._on_write()

    def store(self, offset: int, data: bytes) -> None:
        """Write bytes, which the module handles only in `settle`; the caller has checked the range."""
        end = offset + len(data)
        self._refresh(offset, end)
        self._bytes[offset:end] = data
        for view in self._touched(offset, end):
            if view.put is not None:
                values = view.layout.unpack_from(self._bytes, view.offset)
                view.put(values[0] if len(values) == 1 else values)

    def _refresh(self, start: int, end: int) -> None:
        for view in self._touched(start, end):
            value = view.get()
            values = value if isinstance(value, tuple) else (value,)
            try:
                view.layout.pack_into(self._bytes, view.offset, *values)
            except struct.error:
                code = view.layout.format[-1]
                view.layout.pack_into(self._bytes, view.offset, *(fit(code, value) for value in values))

    def _find(self, start: int, end: int) -> list[_View]:
        return [view for view in self._views if view.offset < end and view.offset + view.layout.size > start]
