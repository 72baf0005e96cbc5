"""A sheet to draw on with Pillow: smooth lines, dashes, marks and text. Lengths are pixels of the finished image."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from PIL import Image, ImageDraw

from firmware_protocol.errors import ConfigError
from nxtdrive.drawing.fonts import parts, width_px

Color = tuple[int, int, int]
"""Red, green, blue, each 0..255."""
Point = tuple[float, float]
Box = tuple[float, float, float, float]
"""Left, top, right, bottom."""

INK: Color = (45, 50, 60)
PAPER: Color = (255, 255, 255)
DIM: Color = (110, 115, 122)
OVERSAMPLING = 2
"""Drawn this much larger and reduced at the end, for smooth edges."""
COLORS = 96
"""Colours of a finished PNG."""

_STAR = tuple((math.sin(i * math.pi / 5), -math.cos(i * math.pi / 5), 1.0 if i % 2 == 0 else 0.42) for i in range(10))
_CLOSED: dict[str, tuple[Point, ...]] = {
    "square": ((-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)),
    "diamond": ((0, -1.1), (1.1, 0), (0, 1.1), (-1.1, 0)),
    "triangle_up": ((0, -1), (1, 0.8), (-1, 0.8)),
    "triangle_down": ((0, 1), (1, -0.8), (-1, -0.8)),
    "star": tuple((1.3 * x * size, 1.3 * y * size) for x, y, size in _STAR),
}
_STROKES: dict[str, tuple[tuple[Point, Point], ...]] = {
    "cross": (((-1, 0), (1, 0)), ((0, -1), (0, 1))),
    "tilted_cross": (((-0.8, -0.8), (0.8, 0.8)), ((-0.8, 0.8), (0.8, -0.8))),
}
MARKERS = ("circle", *_CLOSED, *_STROKES)
"""The shapes of marks."""


class Sheet:
    """A white sheet; later strokes cover earlier ones.

    Args:
        width: Of the finished image.
        height: Of the finished image.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self._image = Image.new("RGB", (width * OVERSAMPLING, height * OVERSAMPLING), PAPER)
        self._draw = ImageDraw.Draw(self._image)

    def line(self, points: Sequence[Point], color: Color, width: float = 1.0, dash: Sequence[float] = ()) -> None:
        """Draw along points; `dash` has the lengths of strokes and gaps in turn, none for a solid line."""
        for stroke in dashes(points, dash) if dash else [points]:
            self._draw.line(self._scaled(stroke), color, max(1, round(width * OVERSAMPLING)), joint="curve")

    def polygon(
        self, points: Sequence[Point], fill: Color | None, outline: Color | None = None, width: float = 1.0
    ) -> None:
        """Draw an area."""
        self._draw.polygon(self._scaled(points), fill, outline, max(1, round(width * OVERSAMPLING)))

    def box(self, box: Box, fill: Color | None, outline: Color | None = None, width: float = 1.0) -> None:
        """Draw a rectangle."""
        left, top, right, bottom = (round(each * OVERSAMPLING) for each in box)
        if right > left and bottom > top:
            line = max(1, round(width * OVERSAMPLING))
            self._draw.rectangle((left, top, right - 1, bottom - 1), fill, outline, line)

    def circle(
        self, at: Point, radius: float, fill: Color | None = None, outline: Color | None = None, width: float = 1.0
    ) -> None:
        """Draw a disc or a ring."""
        corners = self._scaled([(at[0] - radius, at[1] - radius), (at[0] + radius, at[1] + radius)])
        self._draw.ellipse(corners, fill, outline, max(1, round(width * OVERSAMPLING)))

    def marker(self, shape: str, at: Point, size: float, color: Color) -> None:
        """Draw one of `MARKERS` with a white rim; an unknown shape is a circle."""
        x, y = at
        if strokes := _STROKES.get(shape):
            for rim, ink in ((0.3, PAPER), (0.0, color)):
                for (x0, y0), (x1, y1) in strokes:
                    ends = [(x + size * x0, y + size * y0), (x + size * x1, y + size * y1)]
                    self.line(ends, ink, size * (0.45 + 2 * rim))
            return
        for grown, ink in ((size + 2.0, PAPER), (size, color)):
            if corners := _CLOSED.get(shape):
                self.polygon([(x + grown * dx, y + grown * dy) for dx, dy in corners], ink)
            else:
                self.circle(at, grown * 0.85, ink)

    def arrow(self, start: Point, end: Point, color: Color, width: float, head: float) -> None:
        """Draw an arrow with a head of this length."""
        self.line([start, end], color, width)
        angle = math.atan2(end[1] - start[1], end[0] - start[0])
        sides = [
            (end[0] - head * math.cos(angle + turn), end[1] - head * math.sin(angle + turn)) for turn in (-0.5, 0.5)
        ]
        self.polygon([end, *sides], color)

    def text(
        self,
        at: Point,
        text: str,
        size: int,
        color: Color = INK,
        *,
        bold: bool = False,
        anchor: str = "l",
    ) -> None:
        """Write on one line.

        Args:
            at: The left end, the middle or the right end of the base line, as `anchor` says.
            text: What to write.
            size: Of the font.
            color: Of the font.
            bold: Thicker.
            anchor: ``l``, ``m`` or ``r``.
        """
        back = {"l": 0.0, "m": 0.5, "r": 1.0}[anchor]
        x, y = (at[0] - back * text_width(text, size)) * OVERSAMPLING, at[1] * OVERSAMPLING
        stroke = size * OVERSAMPLING / 45 if bold else 0.0
        for part, font in parts(text, size * OVERSAMPLING):
            self._draw.text((x, y), part, color, font, anchor="ls", stroke_width=stroke)
            x += font.getlength(part)

    def finished(self) -> Image.Image:
        """Return the image, RGB."""
        return self._image.reduce(OVERSAMPLING)

    def _scaled(self, points: Sequence[Point]) -> list[Point]:
        return [(x * OVERSAMPLING, y * OVERSAMPLING) for x, y in points]


def text_width(text: str, size: int) -> float:
    """Return the width of a text on a sheet."""
    return width_px(text, size * OVERSAMPLING) / OVERSAMPLING


def wrapped(text: str, size: int, width: float, most: int) -> list[str]:
    """Break a text into lines no longer than `width`; a text of more than `most` lines ends with an ellipsis."""
    lines: list[str] = [""]
    for word in text.split():
        while text_width(word, size) > width:
            head = _head(word, size, width)
            lines, word = [*filter(None, lines), head, ""], word[len(head) :]
        longer = f"{lines[-1]} {word}".strip()
        if text_width(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    lines = list(filter(None, lines))
    if len(lines) > most:
        lines = [*lines[: most - 1], _head(lines[most - 1], size, width - text_width("…", size)) + "…"]
    return lines


def _head(word: str, size: int, width: float) -> str:
    """Return the longest beginning of a word that fits; one character at least."""
    count = 1
    while count < len(word) and text_width(word[: count + 1], size) <= width:
        count += 1
    return word[:count]


def dashes(points: Sequence[Point], pattern: Sequence[float]) -> Iterator[list[Point]]:
    """Yield the strokes of a dashed line; the pattern continues around corners."""
    stroke: list[Point] = []
    i, left = 0, pattern[0]
    for (x0, y0), (x1, y1) in pairwise(points):
        length, done = math.hypot(x1 - x0, y1 - y0), 0.0
        if i % 2 == 0 and not stroke:
            stroke = [(x0, y0)]
        while length - done > left:
            done += left
            place = x0 + (x1 - x0) * done / length, y0 + (y1 - y0) * done / length
            if i % 2 == 0:
                yield [*stroke, place]
            i += 1
            left = pattern[i % len(pattern)]
            stroke = [place] if i % 2 == 0 else []
        left -= length - done
        if i % 2 == 0:
            stroke.append((x1, y1))
    if len(stroke) > 1:
        yield stroke


def encoded(image: Image.Image, path: Path) -> bytes:
    """Return a drawing as a file: a small PNG, or the format that the suffix names.

    Raises:
        ConfigError: No format that can be written in colours has this suffix.
    """
    name = Image.registered_extensions().get(path.suffix.lower())
    if name == "PNG":
        image = image.quantize(COLORS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    content = io.BytesIO()
    try:
        image.save(content, name or path.suffix)
    except (KeyError, OSError, ValueError):  # no such format, or one that is only read, or has no colours
        raise ConfigError(
            f"{path} cannot be written: no image format ends in {path.suffix!r}.", remedy="Use .png."
        ) from None
    return content.getvalue()
