"""The display module: its IO map with the frame buffer, and what programs draw into it.

A line of the frame buffer is eight pixels high, one byte per column, its lowest bit on top. Coordinates of programs
have their origin at the bottom left. Pictures and texts of the firmware's own menus are not drawn, so the buffer is
blank unless a program, or a write to the map, draws.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_protocol.iomap import DISPLAY, DISPLAY_HEIGHT, DISPLAY_WIDTH
from sim_backend.firmware.cint import divide
from sim_backend.firmware.font import CELL_WIDTH, glyph

LINES = 8
_LINE = DISPLAY_HEIGHT // LINES
_START = DISPLAY.field("Normal", 0).offset
_SIZE = LINES * DISPLAY_WIDTH
_OCTANTS = 8
_LAST_COLUMN, _LAST_ROW = DISPLAY_WIDTH - 1, DISPLAY_HEIGHT - 1


_TURN, FILL = 0x04, 0x20
"""Options of drawings."""
COMBINATIONS = 0x3C
"""Those that combine a drawing with the present picture, see `DisplayModule.combine`."""

_WIDTH, _ICON, _MENU_ICON, _STEP = DISPLAY_WIDTH, 12, 24, 11
_ALL, _UNUSED = 29, range(21, 24)
"""The bit of EraseMask that erases all, and those that do so in firmware 1.32."""
_PARTS: Mapping[int, tuple[range, range]] = {
    **{line: (range(line, line + 1), range(_WIDTH)) for line in range(LINES)},
    9: (range(1), range(_WIDTH)),
    10: (range(4, 5), range(_WIDTH)),
    **{13 + number: (range(1), range(x, x + _ICON)) for number, x in enumerate((0, 12, 76, 88))},
    **{17 + number: (range(5, 8), range(x, x + _MENU_ICON)) for number, x in enumerate((7, 38, 69))},
    20: (range(4, 6), range(3, 97)),
    **{24 + number: (range(2, 4), range(x, x + _STEP)) for number, x in enumerate((11, 28, 45, 62, 79))},
    _ALL: (range(LINES), range(_WIDTH)),
    30: (range(1, LINES), range(_WIDTH)),
    31: (range(1, 4), range(_WIDTH)),
}
"""Lines and columns that the bits of EraseMask erase: lines of text, icons of the status bar, of menus and of steps."""


class DisplayModule:
    """The display.

    Args:
        show_status: Called with False when a program takes the screen, with True when it gives it back.
        show_drawing: Called when a program has drawn something.
        drop_drawings: Called when a program clears the screen.
        enhanced: Whether lines are drawn from left to right, and cut off at the edges of the screen first.

    Attributes:
        memory: The module's IO map.
        spend: Called with a number of pixels before they are calculated or drawn; what it raises prevents that.
    """

    def __init__(
        self,
        show_status: Callable[[bool], None] = lambda _: None,
        show_drawing: Callable[[], None] = lambda: None,
        drop_drawings: Callable[[], None] = lambda: None,
        *,
        enhanced: bool = False,
    ) -> None:
        self._show_status, self.show_drawing, self._drop_drawings = show_status, show_drawing, drop_drawings
        self._enhanced = enhanced
        self.memory = bytearray(DISPLAY.size)
        self._drawn = False
        self._shape: dict[tuple[int, int], int] | None = None
        self.spend: Callable[[int], object] = lambda _: None

    @property
    def pixels(self) -> bytes:
        """The frame buffer, 8 lines of 100 bytes."""
        return bytes(self.memory[_START : _START + _SIZE])

    def clear(self) -> None:
        """Make all pixels white."""
        self.memory[_START : _START + _SIZE] = bytes(_SIZE)

    def erase(self, part: int) -> None:
        """Make a part of the screen white, by its bit of EraseMask."""
        lines, columns = _PARTS.get(_ALL if self._enhanced and part in _UNUSED else part, (range(0), range(0)))
        for line in lines:
            start = _START + line * DISPLAY_WIDTH + columns.start
            self.memory[start : start + len(columns)] = bytes(len(columns))

    def begin(self, *, clear: bool, spend: Callable[[int], object]) -> None:
        """Prepare for drawing; the first time, the program takes the screen."""
        self.spend, self._shape = spend, None
        if clear or not self._drawn:
            self.clear()
            self._drop_drawings()
        self.take()

    def take(self) -> None:
        """Take the screen from the firmware's user interface; its picture stays."""
        if not self._drawn:
            self._drawn = True
            self._show_status(False)

    def release(self) -> None:
        """Give the screen back to the firmware's user interface."""
        if self.end():
            self._show_status(True)

    def end(self) -> bool:
        """Forget the program's drawings when it has ended; return whether it had the screen."""
        had_screen, self._drawn = self._drawn, False
        if had_screen:
            self.clear()
        return had_screen

    def collect(self) -> None:
        """Keep what is drawn from now on until `combine`."""
        self._shape = {}

    def combine(self, options: int, *, fills: bool) -> None:
        """Draw what was kept. Options: 4 white, 8, 16 and 24 and, or, exclusive or with what is there, 32 filled."""
        kept, self._shape = self._shape or {}, None
        if fills and options & FILL:
            rows: dict[int, list[int]] = {}
            for x, y in kept:
                if 0 <= y < DISPLAY_HEIGHT:
                    rows.setdefault(y, []).append(x)
            ends = {y: (max(min(columns), 0), min(max(columns), _LAST_COLUMN)) for y, columns in rows.items()}
            kept = {(x, y): 1 for y, (left, right) in ends.items() for x in range(left, right + 1)}
        self.spend(len(kept))
        for (x, y), pixel in kept.items():
            new, old = pixel ^ bool(options & _TURN), self.get(x, y)
            self.set(x, y, (new, old & new, old | new, old ^ new)[options >> 3 & 3])

    def combine_part(self, options: int) -> None:
        """Draw what was kept so far, and keep what follows."""
        if self._shape is not None:
            self.combine(options, fills=False)
            self.collect()

    def point(self, x: int, y: int) -> None:
        """Draw a pixel; nothing outside of the screen. Coordinates have 8 bits, but not in firmware 1.32."""
        if self._enhanced:
            self.set(x, y, 1)
        else:
            self.set(x & 0xFF, y & 0xFF, 1)

    def set(self, x: int, y: int, pixel: int) -> None:
        """Make a pixel black or white; nothing outside of the screen."""
        if self._shape is not None:
            self._shape[x, y] = pixel
        elif 0 <= x < DISPLAY_WIDTH and 0 <= y < DISPLAY_HEIGHT:
            row = DISPLAY_HEIGHT - 1 - y
            at, bit = _START + row // _LINE * DISPLAY_WIDTH + x, 1 << row % _LINE
            self.memory[at] = self.memory[at] | bit if pixel else self.memory[at] & ~bit

    def get(self, x: int, y: int) -> int:
        """Return whether a pixel is black; white outside of the screen."""
        if not (0 <= x < DISPLAY_WIDTH and 0 <= y < DISPLAY_HEIGHT):
            return 0
        row = DISPLAY_HEIGHT - 1 - y
        return self.memory[_START + row // _LINE * DISPLAY_WIDTH + x] >> row % _LINE & 1

    def line(self, x: int, y: int, end_x: int, end_y: int) -> None:
        """Draw a line by Bresenham's algorithm, which decides ties by the direction of drawing."""
        if self._enhanced:
            ends = _cut((x, y, end_x, end_y) if x <= end_x else (end_x, end_y, x, y))
            if ends is None:
                return
            x, y, end_x, end_y = ends
        across, up = abs(end_x - x), abs(end_y - y)
        step_x, step_y = 1 if x < end_x else -1, 1 if y < end_y else -1
        steep = across <= up
        longer, shorter = (up, across) if steep else (across, up)
        error = 2 * shorter - longer
        self.spend(longer)
        self.point(x, y)
        for _ in range(longer):
            if error >= 0:
                x, y = (x + step_x, y) if steep else (x, y + step_y)
                error -= 2 * longer
            x, y = (x, y + step_y) if steep else (x + step_x, y)
            error += 2 * shorter
            self.point(x, y)

    def rectangle(self, x: int, y: int, width: int, height: int) -> None:
        """Draw the outline from (x, y) to (x + width, y + height)."""
        right, top = x + width, y + height
        self.line(x, y, right, y)
        self.line(x, top, right, top)
        for side in (x, right):
            if self._shape is not None:  # a shape is filled between its sides, which may be beyond the screen
                self._shape |= {(side, row): 1 for row in range(max(min(y, top), 0), min(max(y, top), _LAST_ROW) + 1)}
            else:
                self.line(side, y, side, top)

    def circle(self, x: int, y: int, radius: int) -> None:
        """Draw a circle by the midpoint algorithm."""
        self.spend(max(radius, 0) * _OCTANTS)
        across, up, error = 0, radius, 1 - radius
        self._octants(x, y, across, up)
        while across < up:
            if error >= 0:
                up -= 1
                error -= 2 * up
            across += 1
            error += 2 * across + 1
            self._octants(x, y, across, up)

    def _octants(self, x: int, y: int, across: int, up: int) -> None:
        for a, b in ((across, up), (up, across)):
            for left in (x - a, x + a):
                self.point(left, y - b)
                self.point(left, y + b)

    def text(self, x: int, y: int, characters: bytes, *, anywhere: bool = False) -> None:
        """Draw text into the line of eight pixels that contains `y`; characters replace what was there.

        Args:
            x: Its left edge; of both coordinates, the low 8 bits count.
            y: Its lower edge if it can be `anywhere`.
            characters: The text; it ends at the edge of the screen.
            anywhere: Whether it need not fill a line of eight pixels; then it may use the last column, too.
        """
        x, y = x & 0xFF, y & 0xFF
        if anywhere:
            self._text_anywhere(x, y, characters)
            return
        if y >= DISPLAY_HEIGHT:
            return
        start = _START + (DISPLAY_HEIGHT - 1 - y) // _LINE * DISPLAY_WIDTH
        for character in characters:
            columns = glyph(character)
            if columns is None:
                continue
            if x + CELL_WIDTH > DISPLAY_WIDTH - 1:
                return
            self.memory[start + x : start + x + CELL_WIDTH] = columns
            x += CELL_WIDTH

    def _text_anywhere(self, x: int, y: int, characters: bytes) -> None:
        for columns in filter(None, map(glyph, characters)):
            if x > DISPLAY_WIDTH - CELL_WIDTH:
                return
            for column, bits in enumerate(columns):
                for row in range(_LINE):
                    self.set(x + column, y + _LINE - 1 - row & 0xFF, bits >> row & 1)
            x += CELL_WIDTH


def _cut(line: tuple[int, int, int, int]) -> tuple[int, int, int, int] | None:
    """Return the part of a line on the screen, or None: its ends are cut off at top or bottom, then at the sides.

    Rows are bytes that count from the top, so an end that a truncated slope leaves above the screen is far below it.
    """
    x, y, end_x, end_y = line
    across, up = end_x - x, end_y - y
    if _beyond(x, end_x, _LAST_COLUMN) or _beyond(y, end_y, _LAST_ROW):
        return None
    if (edge := _nearest(y, _LAST_ROW)) != y:
        x, y = x + divide(across * (edge - y), up), edge
    if (edge := _nearest(end_y, _LAST_ROW)) != end_y:
        end_x, end_y = end_x + divide(across * (edge - end_y), up), edge
    if _beyond(x, end_x, _LAST_COLUMN):
        return None
    if (edge := _nearest(x, _LAST_COLUMN)) != x:
        x, y = edge, y + divide(up * (edge - x), across)
    if (edge := _nearest(end_x, _LAST_COLUMN)) != end_x:
        end_x, end_y = edge, end_y + divide(up * (edge - end_x), across)
    return x, _LAST_ROW - (_LAST_ROW - y & 0xFF), end_x, _LAST_ROW - (_LAST_ROW - end_y & 0xFF)


def _beyond(first: int, last: int, limit: int) -> bool:
    return max(first, last) < 0 or min(first, last) > limit


def _nearest(value: int, limit: int) -> int:
    return max(0, min(value, limit))
