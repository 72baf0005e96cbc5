"""Draw picture files (.ric): a list of drawing instructions, whose coordinates may be parameters of the call.

Source: the published format of NXT picture files; docs/firmware.md section 8.5.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

from firmware_protocol.iomap import DISPLAY_HEIGHT, DISPLAY_WIDTH
from sim_backend.firmware.cint import divide, s16
from sim_backend.firmware.display import COMBINATIONS, DisplayModule
from sim_backend.firmware.vm.calls import Call
from sim_backend.firmware.vm.shapes import draw_ellipse, draw_polygon

_DESCRIPTION, _SPRITE, _MAP, _COPY, _PIXEL, _LINE, _RECTANGLE, _CIRCLE, _NUMBER, _ELLIPSE, _POLYGON = range(11)
_WORDS = {
    _SPRITE: 3,
    _MAP: 2,
    _COPY: 8,
    _PIXEL: 4,
    _LINE: 5,
    _RECTANGLE: 5,
    _CIRCLE: 4,
    _NUMBER: 4,
    _ELLIPSE: 5,
    _POLYGON: 2,
}
"""Least number of words after the opcode; an instruction with fewer does nothing."""
_DRAWINGS = range(_COPY, _POLYGON + 1)
_BLOCKS = (_COPY, _NUMBER)
_UNFILLED = (_PIXEL, _LINE, _POLYGON)
"""Drawings that an option does not fill, or that fill themselves."""
_LEAVES_SHAPES = 0x1C, (0x08, 0x14, 0x1C)
"""Bits of the options of which these values draw shapes as without options."""
_OPCODES = frozenset(range(_NUMBER + 1)) - {_CIRCLE}
_ENHANCED_OPCODES = frozenset(range(_POLYGON + 1))
"""The instructions, before and in 1.32; another one ends the drawing."""
_NUMBERS = range(1, 11)
"""Numbers that sprites and maps may have."""
DRAWN, _ERASED = 0xFD, 0xFF
_SPRITE_HEADER = 6
_POINTS_AT, _POINT = 4, 4
_PARAMETER, _MAP_SHIFT, _MAP_MASK, _INDEX_MASK, _ENHANCED_INDEX_MASK = 0xF000, 8, 0xF, 0xF, 0xFF
_PARAMETERS = _INDEX_MASK + 1
"""Parameters that a picture can name before 1.32, however many there are."""
_HEADER = struct.Struct("<HH")


class _Sprite(NamedTuple):
    """Rows and bytes of a row, and where in the file they are."""

    rows: int
    stride: int
    at: int


class _Picture:
    """A picture that is being drawn at a point."""

    def __init__(
        self,
        display: DisplayModule,
        content: bytes,
        origin: Sequence[int],
        parameters: Sequence[int],
        *,
        enhanced: bool,
    ) -> None:
        self._enhanced = enhanced
        self._display, self._content, (self._x, self._y), self._parameters = display, content, origin, parameters
        self._sprites: dict[int, _Sprite] = {}
        self._maps: dict[int, list[tuple[int, int]]] = {}

    def draw(self, opcode: int, start: int, size: int) -> None:
        """Execute one instruction, whose arguments are `size` bytes of the file."""
        count = len(self._content[start : start + size]) // 2
        if count < _WORDS.get(opcode, 0):
            return
        words = struct.unpack_from(f"<{count}H", self._content, start)
        if opcode == _POLYGON:  # its points are as many as it says, whatever its size is
            points = self._content[start + _POINTS_AT : start + _POINTS_AT + words[1] * _POINT]
            words = *words[:2], *struct.unpack(f"<{len(points) // 2}H", points[: len(points) // 2 * 2])
        if opcode == _SPRITE:
            if words[0] in _NUMBERS:
                self._sprites[words[0]] = _Sprite(words[1], words[2], start + _SPRITE_HEADER)
        elif opcode == _MAP:
            if words[0] in _NUMBERS:
                self._maps[words[0]] = list(zip(words[2::2], words[3::2], strict=False))[: words[1]]
        elif opcode in _DRAWINGS:
            options = words[0] & COMBINATIONS if self._enhanced else 0
            mask, ignored = _LEAVES_SHAPES
            if opcode not in _BLOCKS and options & mask in ignored:
                options = 0
            if options:
                self._display.collect()
            self._draw(opcode, words, options)
            if options:
                self._display.combine(options, fills=opcode not in _UNFILLED)

    def _draw(self, opcode: int, words: Sequence[int], options: int) -> None:
        display = self._display
        if opcode == _COPY:
            self._copy(self._value(words[1]) & 0xFFFF, *(s16(self._value(word)) for word in words[2:8]))
            return
        if opcode == _POLYGON:
            corners = [
                (self._x + s16(self._value(x)), self._y + s16(self._value(y)))
                for x, y in zip(words[2::2], words[3::2], strict=False)
            ]
            if words[1] > 2:
                draw_polygon(display, corners, options)
            return
        values = [s16(self._value(word)) for word in words[1:]]
        at = self._x + values[0], self._y + values[1]
        if opcode == _PIXEL:
            display.point(*at)
        elif opcode == _LINE:
            display.line(*at, self._x + values[2], self._y + values[3])
        elif opcode == _RECTANGLE:
            display.rectangle(*at, values[2], values[3])
        elif opcode == _CIRCLE:
            display.circle(*at, values[2])
        elif opcode == _ELLIPSE:
            draw_ellipse(display, *at, values[2], values[3])
        else:
            display.text(*at, str(self._value(words[3])).encode(), anywhere=self._enhanced)

    def _value(self, word: int) -> int:
        """Return a number, or a parameter, perhaps mapped; in 1.32 a parameter that does not exist is a number."""
        index = word & (_ENHANCED_INDEX_MASK if self._enhanced else _INDEX_MASK)
        if not word & _PARAMETER or index >= len(self._parameters):
            return s16(word)
        value = self._parameters[index]
        table = self._maps.get(word >> _MAP_SHIFT & _MAP_MASK)
        if not table:
            return value
        self._display.spend(len(table))
        return _interpolate(table, value)

    def _copy(self, sprite: int, left: int, bottom: int, width: int, height: int, x: int, y: int) -> None:
        """Copy a part of a sprite; its rows are stored from the top, its highest bit is on the left.

        Pixels outside of the sprite are read from the file beside it, or from erased flash.
        """
        if sprite not in self._sprites:
            return
        rows, stride, start = self._sprites[sprite]
        width, height = min(max(width, 0), DISPLAY_WIDTH), min(max(height, 0), DISPLAY_HEIGHT)
        self._display.spend(width * height)
        for row in range(height):
            for column in range(width):
                at_row, at_column = rows - 1 - bottom - row, left + column
                at = start + at_row * stride + at_column // 8
                byte = self._content[at] if 0 <= at < len(self._content) else _ERASED
                self._display.set(self._x + x + column, self._y + y + row, byte >> 7 - at_column % 8 & 1)


def _interpolate(table: Sequence[tuple[int, int]], value: int) -> int:
    """Return the value of a map, linear between its points."""
    before = table[0]
    for point in table:
        if value <= point[0]:
            if value == point[0] or point == before:
                return point[1]
            span, rise = point[0] - before[0], s16(point[1]) - s16(before[1])
            return s16(before[1]) + divide((value - before[0]) * rise, span)
        before = point
    return table[-1][1]


def draw_content(call: Call, content: bytes) -> int:
    """Draw a picture; return the status.

    Args:
        call: Its arguments are status, point, the picture, and parameters.
        content: The picture's instructions.
    """
    enhanced, at = call.machine.dialect.enhanced_calls, 0
    parameters = call.longs(3, None if enhanced else _PARAMETERS)
    opcodes = _ENHANCED_OPCODES if enhanced else _OPCODES
    picture = _Picture(call.devices.display, content, call.pair(1), parameters, enhanced=enhanced)
    while at + _HEADER.size <= len(content):
        size, opcode = _HEADER.unpack_from(content, at)
        if size % 2 or opcode not in opcodes:
            break
        picture.draw(opcode, at + _HEADER.size, size - 2)
        at += 2 + size
    return DRAWN
