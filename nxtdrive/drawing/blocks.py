"""The blocks of text on a page: legend, notes, and the tags with their numbers and names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from nxtdrive.drawing.legend import SAMPLE_PX, Key
from nxtdrive.drawing.sheet import DIM, INK, PAPER, Box, Color, Point, Sheet, text_width, wrapped

BODY, HEADING, LABEL = 17, 18, 18
"""Sizes of text."""
LINE_PX, NOTE_GAP_PX, HEADING_PX = 23, 9, 30.0
ROW_PX, KEY_PX = 28, 440.0
"""Height of a row of the legend; greatest width of a column."""
BADGE_PX, BADGE_HEIGHT_PX = 32.0, 26.0
"""A number's box."""
NAME_PX = 240.0
"""Longer names are cut."""


@dataclass(frozen=True, slots=True)
class Note:
    """A description of what happened.

    Attributes:
        badge: Its number on the map; empty without one.
        head: When and what.
        lines: More about it.
        color: Of the number.
    """

    badge: str
    head: str
    lines: tuple[str, ...] = ()
    color: Color = INK


@dataclass(frozen=True, slots=True)
class Tag:
    """A box with text on the map, beside its place: a number, or a name.

    Attributes:
        place: On the floor; millimetres to the right and downwards.
        text: What is written.
        color: Of the box.
        number: Whether it is the number of a note.
    """

    place: Point
    text: str
    color: Color
    number: bool = True


def tag_size(tag: Tag) -> Point:
    """Return width and height of a tag."""
    return max(BADGE_PX if tag.number else 0.0, text_width(_shown(tag), LABEL) + 10), BADGE_HEIGHT_PX


def draw_tag(sheet: Sheet, tag: Tag, box: Box) -> None:
    """Draw a tag in its box."""
    base = (box[0] + box[2]) / 2, box[3] - 7
    if tag.number:
        sheet.box(box, PAPER, tag.color, 2)
        sheet.text(base, _shown(tag), LABEL, INK, bold=True, anchor="m")
    else:
        sheet.box(box, PAPER)  # a dot above a letter would look like an accent
        sheet.text(base, _shown(tag), LABEL, tag.color, bold=True, anchor="m")


def _shown(tag: Tag) -> str:
    return "".join(wrapped(tag.text, LABEL, NAME_PX, 1))


class LegendBlock:
    """The legend in columns of equal width.

    Args:
        keys: In order, from the top of the first column.
        width: Of all columns.

    Attributes:
        fits: Whether the width is enough for a column in which no text is cut that fits into another one.
    """

    def __init__(self, keys: Sequence[Key], width: float) -> None:
        widest = max((text_width(key.text, BODY) for key in keys), default=0.0)
        self._keys = keys
        needed = min(KEY_PX, SAMPLE_PX + widest + 36)
        self._column, self.fits = min(width, needed), width >= needed
        self._rows = math.ceil(len(keys) / max(1, int(width // self._column)))

    @property
    def height(self) -> float:
        """Of all rows."""
        return self._rows * ROW_PX

    def draw(self, sheet: Sheet, corner: Point) -> None:
        """Draw it."""
        for i, key in enumerate(self._keys):
            column, row = divmod(i, self._rows)
            left, middle = corner[0] + column * self._column, corner[1] + (row + 0.5) * ROW_PX
            key.paint(sheet, (left + SAMPLE_PX / 2, middle))
            text = wrapped(key.text, BODY, self._column - SAMPLE_PX - 14, 1)
            sheet.text((left + SAMPLE_PX + 10, middle + 6), "".join(text), BODY)


class NotesBlock:
    """The notes, broken into lines of a column's width.

    Args:
        heading: Above them; empty for none.
        notes: In order.
        width: Of a column.
    """

    def __init__(self, heading: str, notes: Sequence[Note], width: float) -> None:
        self._heading = heading
        self._head_px = HEADING_PX if heading else 0.0
        self._blocks = [_Block(note, _lines(note, width - BADGE_PX - 12)) for note in notes]

    def height(self, columns: int) -> float:
        """Return the height when set in this many columns."""
        return self._head_px + max(sum(block.height for block in part) for part in self._split(columns))

    def draw(self, sheet: Sheet, columns: Sequence[float], top: float) -> None:
        """Draw the columns, given by their left edges."""
        if self._heading:
            sheet.text((columns[0], top + 8), self._heading, HEADING, bold=True)
        for left, part in zip(columns, self._split(len(columns)), strict=True):
            y = top + self._head_px
            for block in part:
                if block.note.badge:
                    box = (left, y - 1, left + BADGE_PX, y - 1 + BADGE_HEIGHT_PX)
                    draw_tag(sheet, Tag((0, 0), block.note.badge, block.note.color), box)
                for i, (text, color) in enumerate(block.lines):
                    sheet.text((left + BADGE_PX + 12, y + 17 + i * LINE_PX), text, BODY, color)
                y += block.height

    def _split(self, columns: int) -> list[list[_Block]]:
        """Distribute the notes over columns of about the same height, in order."""
        parts: list[list[_Block]] = [[] for _ in range(columns)]
        total, done = sum(block.height for block in self._blocks), 0.0
        for block in self._blocks:
            parts[int(done / total * columns)].append(block)
            done += block.height
        return parts


@dataclass(frozen=True, slots=True)
class _Block:
    """A note's lines with their colours."""

    note: Note
    lines: list[tuple[str, Color]]

    @property
    def height(self) -> float:
        return len(self.lines) * LINE_PX + NOTE_GAP_PX


def _lines(note: Note, width: float) -> list[tuple[str, Color]]:
    head = [(text, INK) for text in wrapped(note.head, BODY, width, 3)]
    return [*head, *((text, DIM) for line in note.lines for text in wrapped(line, BODY, width, 3))]
