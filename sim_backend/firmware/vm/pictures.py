"""Draw picture files (.ric): a list of drawing instructions, whose coordinates may be parameters of the call.

Source: the published format of NXT picture files; docs/firmware.md section 8.5.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from firmware_protocol.status import Status
from sim_backend.firmware.cint import divide, s16
from sim_backend.firmware.display import DisplayModule
from sim_backend.firmware.loader import Loader

_DESCRIPTION, _SPRITE, _MAP, _COPY, _PIXEL, _LINE, _RECTANGLE, _CIRCLE, _NUMBER = range(9)
_PARAMETER, _MAP_SHIFT, _MAP_MASK, _INDEX_MASK = 0x1000, 8, 0xF, 0xFF
_TABLES = 16
_HEADER = struct.Struct("<HH")


class _Picture:
    """A picture that is being drawn at a point."""

    def __init__(self, display: DisplayModule, origin: Sequence[int], parameters: Sequence[int]) -> None:
        self._display, (self._x, self._y), self._parameters = display, origin, parameters
        self._sprites: dict[int, tuple[int, bytes]] = {}
        self._maps: dict[int, list[tuple[int, int]]] = {}

    def draw(self, opcode: int, content: bytes) -> None:
        """Carry out one instruction."""
        words = struct.unpack(f"<{len(content) // 2}H", content[: len(content) // 2 * 2])
        display, x, y = self._display, self._x, self._y
        if opcode == _SPRITE:
            self._sprites[words[0]] = (words[2], content[6 : 6 + words[1] * words[2]])
        elif opcode == _MAP:
            self._maps[words[0]] = list(zip(words[2::2], words[3::2], strict=False))[: words[1]]
        elif opcode == _COPY:
            self._copy(self._value(words[1]), *(s16(self._value(word)) for word in words[2:8]))
        elif opcode in (_PIXEL, _LINE, _RECTANGLE, _CIRCLE, _NUMBER):
            values = [s16(self._value(word)) for word in words[1:]]
            at = x + values[0], y + values[1]
            if opcode == _PIXEL:
                display.point(*at)
            elif opcode == _LINE:
                display.line(*at, x + values[2], y + values[3])
            elif opcode == _RECTANGLE:
                display.rectangle(*at, values[2], values[3])
            elif opcode == _CIRCLE:
                display.circle(*at, values[2])
            else:
                display.text(*at, str(values[2]).encode())

    def _value(self, word: int) -> int:
        """A number, or a parameter, perhaps mapped."""
        if not word & _PARAMETER:
            return word
        index = word & _INDEX_MASK
        value = self._parameters[index] if index < len(self._parameters) else 0
        table = self._maps.get(word >> _MAP_SHIFT & _MAP_MASK)
        return _interpolate(table, value) if table else value

    def _copy(self, sprite: int, left: int, bottom: int, width: int, height: int, x: int, y: int) -> None:
        """Copy a part of a sprite; its rows are stored from the top, its highest bit is on the left."""
        if sprite not in self._sprites:
            return
        stride, bits = self._sprites[sprite]
        rows = len(bits) // stride if stride else 0
        for row in range(max(height, 0)):
            for column in range(max(width, 0)):
                at_row, at_column = rows - 1 - bottom - row, left + column
                if 0 <= at_row < rows and 0 <= at_column < 8 * stride:
                    byte = bits[at_row * stride + at_column // 8]
                    self._display.set(self._x + x + column, self._y + y + row, byte >> 7 - at_column % 8 & 1)


def _interpolate(table: Sequence[tuple[int, int]], value: int) -> int:
    """The value of a map, linear between its points."""
    before = table[0]
    for point in table:
        if value <= point[0]:
            if value == point[0] or point == before:
                return point[1]
            span, rise = point[0] - before[0], s16(point[1]) - s16(before[1])
            return s16(before[1]) + divide((value - before[0]) * rise, span)
        before = point
    return table[-1][1]


def draw_picture(
    display: DisplayModule, loader: Loader, name: bytes, origin: Sequence[int], parameters: Sequence[int]
) -> int:
    """Draw a picture file; returns the status."""
    opened = loader.open_read(name.decode("latin-1"))
    if opened.status:
        return opened.status
    content = loader.read(opened.handle, opened.size)[1]
    loader.close(opened.handle)
    picture, at = _Picture(display, origin, parameters), 0
    while at + _HEADER.size <= len(content):
        size, opcode = _HEADER.unpack_from(content, at)
        try:
            picture.draw(opcode, content[at + _HEADER.size : at + 2 + size])
        except (struct.error, IndexError, TypeError, ValueError):
            return Status.FILE_NOT_FOUND
        at += 2 + size + size % 2
    return Status.OK
