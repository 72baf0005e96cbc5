"""A piece of floor in a frame: scale, grid, ticks, and the conversion from millimetres to pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from nxtdrive.drawing.sheet import DIM, INK, PAPER, Box, Color, Point, Sheet

GRID: Color = (216, 219, 222)
TICK_PX = 75.0
"""Ticks are at least this far apart."""
SMALL = 15
TICKS_PX, TITLE_PX, BAR_PX = 24, 46, 70
"""Below the frame: base lines of the ticks' numbers, of the axis' title and of the scale bar."""
LEFT_PX, BELOW_PX = 74, 80
"""Space that the axes need to the left of the frame and below it."""


@dataclass(frozen=True, slots=True)
class Axes:
    """What the axes are called and which way they count.

    Attributes:
        across: What the axis to the right means, with its unit.
        along: What the vertical axis means, with its unit.
        up: Whether the vertical axis counts upwards.
    """

    across: str
    along: str
    up: bool


@dataclass(frozen=True, slots=True)
class Area:
    """A piece of floor as it lies on the page; millimetres to the right and downwards."""

    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def around(cls, points: Sequence[Point], margin_mm: float, smallest_mm: float) -> Area:
        """Return an area with all points in it, some margin, and at least this wide and high."""
        xs, ys = ([point[i] for point in points] for i in (0, 1))
        (left, right), (top, bottom) = (_stretched(each, margin_mm, smallest_mm) for each in (xs, ys))
        return cls(left, top, right, bottom)

    @property
    def width(self) -> float:
        """Millimetres from left to right."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Millimetres from top to bottom."""
        return self.bottom - self.top

    def holds(self, point: Point, margin_mm: float = 0.0) -> bool:
        """Return whether a point is inside, or no farther outside than the margin."""
        return (
            self.left - margin_mm <= point[0] <= self.right + margin_mm
            and self.top - margin_mm <= point[1] <= self.bottom + margin_mm
        )


def _stretched(values: Sequence[float], margin_mm: float, smallest_mm: float) -> tuple[float, float]:
    low, high = min(values) - margin_mm, max(values) + margin_mm
    lacking = max(0.0, smallest_mm - (high - low)) / 2
    return low - lacking, high + lacking


class FloorView:
    """An area of floor in a frame on a sheet.

    Args:
        sheet: What to draw on.
        area: What is shown.
        axes: Its axes.
        corner: Upper left corner of the frame.
        most: Maximum width and height of the frame.

    Attributes:
        sheet: As given.
        area: As given.
        scale: Pixels per millimetre.
        frame: On the sheet.
    """

    def __init__(self, sheet: Sheet, area: Area, axes: Axes, corner: Point, most: Point) -> None:
        self.sheet, self.area, self._axes = sheet, area, axes
        self.scale = scale_for(area, most)
        left, top = corner
        self.frame: Box = (left, top, left + area.width * self.scale, top + area.height * self.scale)

    def at(self, point: Point) -> Point:
        """Return the pixel of a place, given in millimetres to the right and downwards."""
        return (
            self.frame[0] + (point[0] - self.area.left) * self.scale,
            self.frame[1] + (point[1] - self.area.top) * self.scale,
        )

    def all_at(self, points: Sequence[Point]) -> list[Point]:
        """Return the pixels of places."""
        return [self.at(point) for point in points]

    def draw_grid(self) -> None:
        """Draw a line for each tick, on whole pixels: spread over two, it is too pale for the colours of a PNG."""
        left, top, right, bottom = self.frame
        for x, _ in self._ticks(across=True):
            self.sheet.line([(math.floor(x), top), (math.floor(x), bottom)], GRID)
        for y, _ in self._ticks(across=False):
            self.sheet.line([(left, math.floor(y)), (right, math.floor(y))], GRID)

    def draw_axes(self) -> None:
        """Hide everything outside the frame; draw frame, ticks and the axes' titles."""
        sheet, (left, top, right, bottom) = self.sheet, self.frame
        outside = [(0, 0, sheet.width, top), (0, bottom, sheet.width, sheet.height)]
        for box in (*outside, (0, top, left, bottom), (right, top, sheet.width, bottom)):
            sheet.box(box, PAPER)
        sheet.box(self.frame, None, DIM, 1.5)
        for x, text in self._ticks(across=True):
            sheet.line([(x, bottom), (x, bottom + 6)], DIM, 1.5)
            sheet.text((x, bottom + TICKS_PX), text, SMALL, DIM, anchor="m")
        for y, text in self._ticks(across=False):
            sheet.line([(left - 6, y), (left, y)], DIM, 1.5)
            sheet.text((left - 10, y + 5), text, SMALL, DIM, anchor="r")
        sheet.text((left, bottom + TITLE_PX), f"→ {self._axes.across}", SMALL, INK)
        sheet.text((left, top - 10), f"{'↑' if self._axes.up else '↓'} {self._axes.along}", SMALL, INK)
        self._draw_scale_bar()

    def _draw_scale_bar(self) -> None:
        left, base = self.frame[0], self.frame[3] + BAR_PX
        length_mm = tick_mm(TICK_PX / self.scale)
        right = left + length_mm * self.scale
        self.sheet.line([(left, base - 4), (right, base - 4)], INK, 4.0)
        for x in (left, right):
            self.sheet.line([(x, base - 10), (x, base + 2)], INK, 1.5)
        self.sheet.text((right + 8, base), f"{length_mm / 1000:g} m", SMALL, INK)

    def _ticks(self, *, across: bool) -> Iterator[tuple[float, str]]:
        """Yield the pixel and the number, in metres, of each tick of an axis."""
        area, step = self.area, tick_mm(TICK_PX / self.scale)
        low, high = (area.left, area.right) if across else (area.top, area.bottom)
        sign = -1 if not across and self._axes.up else 1
        for i in range(math.ceil(low / step), math.floor(high / step) + 1):
            x, y = self.at((i * step, i * step))
            yield (x if across else y), f"{sign * i * step / 1000 + 0.0:g}"


def scale_for(area: Area, most: Point) -> float:
    """Return the pixels per millimetre at which an area just fits."""
    return min(most[0] / area.width, most[1] / area.height)


def tick_mm(least_mm: float) -> float:
    """Return the smallest of 1, 2, 5, 10, 20, 50 ... mm that is at least this."""
    power = 10.0 ** math.floor(math.log10(least_mm))
    return next(power * each for each in (1, 2, 5, 10) if power * each >= least_mm * (1 - 1e-9))
