"""Polygons and ellipses, which only firmware 1.32 draws. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from firmware_protocol.iomap import DISPLAY_HEIGHT, DISPLAY_WIDTH
from sim_backend.firmware.cint import divide
from sim_backend.firmware.display import FILL, DisplayModule

_QUADRANTS = 4


def draw_polygon(display: DisplayModule, corners: Sequence[tuple[int, int]], options: int) -> None:
    """Draw a closed polygon, and combine it line by line unless it is filled."""
    if options & FILL:
        display.spend(len(corners) * DISPLAY_HEIGHT)
        for x, y in _inside(corners):
            display.point(x, y)
        return
    display.spend(len(corners))
    for start, end in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        display.line(*start, *end)
        display.combine_part(options)


def _inside(corners: Sequence[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Return the pixels of a filled polygon: those from edge to edge of each row between its lowest and highest one."""
    heights = [y for _, y in corners]
    for y in range(max(min(heights, default=0) + 1, 0), min(max(heights, default=0), DISPLAY_HEIGHT)):
        crossings = sorted(
            x + divide((y - start) * (end_x - x), end - start)
            for (x, start), (end_x, end) in zip(corners, [*corners[-1:], *corners[:-1]], strict=True)
            if min(start, end) < y <= max(start, end)
        )
        edges = zip(crossings[::2], crossings[1::2], strict=False)
        columns = {x for left, right in edges for x in range(max(left, 0), min(right + 1, DISPLAY_WIDTH))}
        yield from ((x, y) for x in columns)


def draw_ellipse(display: DisplayModule, x: int, y: int, width: int, height: int) -> None:
    """Draw an ellipse around (x, y) with these radii."""
    display.spend(_QUADRANTS * (max(width, 0) + max(height, 0)))
    for across, up in _quadrant(width, height):
        for left in (x - across, x + across):
            display.point(left, y - up)
            display.point(left, y + up)


def _quadrant(width: int, height: int) -> Iterator[tuple[int, int]]:
    """Return a quarter of an ellipse by McIlroy's algorithm, from its top to its right end."""
    x, y = 0, height
    width_2, height_2 = width * width, height * height
    lowest = -(width_2 // 4 + width % 2 + height_2)
    right = -(height_2 // 4 + height % 2 + width_2)
    flat = -(height_2 // 4 + height % 2)
    error, change_x, change_y = -width_2 * y, 0, -2 * width_2 * y
    while y >= 0 and x <= width:
        yield x, y
        level = error + height_2 * x <= lowest or error + width_2 * y <= flat
        if level or error - width_2 * y <= right:
            x += 1
            change_x += 2 * height_2
            error += change_x
        if not level:
            y -= 1
            change_y += 2 * width_2
            error += change_y
