"""A page around a map: title above, legend below, numbered notes beside it; for a wide map, below it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PIL import Image

from nxtdrive.drawing.blocks import LegendBlock, Note, NotesBlock, Tag, draw_tag, tag_size
from nxtdrive.drawing.floor_view import BELOW_PX, LEFT_PX, Area, Axes, FloorView, scale_for
from nxtdrive.drawing.label_placement import centre, place_boxes
from nxtdrive.drawing.legend import Key
from nxtdrive.drawing.sheet import DIM, PAPER, Box, Point, Sheet, text_width, wrapped

WIDTH, MARGIN = 1600, 40
NARROWEST = 800
"""Width of a page without notes at least: the legend needs it."""
INNER_PX = float(WIDTH - 2 * MARGIN)
TITLE, SUBTITLE = 32, 18
TITLE_PX, SUBTITLE_PX = 40, 26
"""Sizes of text, and heights of its lines."""
GAP_PX = 36
"""Between the columns of the page."""
NOTES_PX = 520
"""Minimum width of a column of notes."""
MAP_PX = 860.0
"""Maximum height of the map."""
SECTION_PX = 22
"""Above and below the legend."""
KEEP_PX = 12.0
"""Half the width of a place that must not be covered."""
FAR_PX = 55.0
"""A name farther than this from its place is joined to it by a line."""
WIDE = 1.3
"""Maps at least this much wider than high get the notes below."""


@dataclass(frozen=True, slots=True)
class Page:
    """The contents of a page.

    Attributes:
        title: The heading.
        subtitle: More about it.
        area: The floor that the map shows.
        axes: The map's axes.
        paint: Draws the map.
        keys: The legend.
        heading: Above the notes.
        notes: What happened.
        tags: Numbers and names on the map, the most important first.
        avoid: Places that they should not cover.
        keep: Places that they must not cover.
    """

    title: str
    subtitle: str
    area: Area
    axes: Axes
    paint: Callable[[FloorView], None]
    keys: Sequence[Key]
    heading: str = ""
    notes: Sequence[Note] = ()
    tags: Sequence[Tag] = ()
    avoid: Sequence[Point] = ()
    keep: Sequence[Point] = ()


def draw_page(page: Page) -> Image.Image:
    """Draw a page; returns an RGB image `WIDTH` pixels wide, or without notes as wide as map and title need."""
    titles = wrapped(page.title, TITLE, INNER_PX, 1)
    subtitles = wrapped(page.subtitle, SUBTITLE, INNER_PX, 3)
    top = MARGIN + TITLE_PX * len(titles) + SUBTITLE_PX * len(subtitles) + 30
    wide = page.area.width >= WIDE * page.area.height or not page.notes
    layout = _below(page, top) if wide else _beside(page, top)
    sheet = Sheet(layout.width, math.ceil(layout.bottom + MARGIN))
    view = FloorView(sheet, page.area, page.axes, (MARGIN + LEFT_PX, top), layout.most)
    view.draw_grid()
    page.paint(view)
    view.draw_axes()
    _draw_tags(view, page)
    for i, text in enumerate(titles):
        sheet.text((MARGIN, MARGIN + 26 + TITLE_PX * i), text, TITLE, bold=True)
    for i, text in enumerate(subtitles):
        sheet.text((MARGIN, MARGIN + TITLE_PX * len(titles) + 18 + SUBTITLE_PX * i), text, SUBTITLE, DIM)
    layout.legend.draw(sheet, (MARGIN, layout.legend_top))
    layout.notes.draw(sheet, layout.columns, layout.notes_top)
    return sheet.finished()


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where things are on a page: its width, the map's greatest size, then the blocks with their upper edges."""

    width: int
    most: Point
    legend: LegendBlock
    legend_top: float
    notes: NotesBlock
    notes_top: float
    columns: tuple[float, ...]

    @property
    def bottom(self) -> float:
        notes_bottom = self.notes_top + self.notes.height(len(self.columns))
        return max(self.legend_top + self.legend.height, notes_bottom)


def _below(page: Page, top: float) -> _Layout:
    """Place the legend below the map, and the notes below the legend in two columns."""
    most = (INNER_PX - LEFT_PX, MAP_PX)
    scale = scale_for(page.area, most)
    width = WIDTH if page.notes else _width_without_notes(page, scale)
    legend = LegendBlock(page.keys, width - 2 * MARGIN)
    legend_top = top + page.area.height * scale + BELOW_PX + SECTION_PX
    notes = NotesBlock(page.heading, page.notes, (INNER_PX - GAP_PX) / 2)
    columns = (float(MARGIN), (WIDTH + GAP_PX) / 2)
    return _Layout(width, most, legend, legend_top, notes, legend_top + legend.height + SECTION_PX, columns)


def _width_without_notes(page: Page, scale: float) -> int:
    texts = max(text_width(page.title, TITLE), text_width(page.subtitle, SUBTITLE))
    inner = max(LEFT_PX + page.area.width * scale, texts)
    return max(NARROWEST, math.ceil(min(inner, INNER_PX)) + 2 * MARGIN)


def _beside(page: Page, top: float) -> _Layout:
    """Place the notes to the right of the map; the legend below the map, or if there is no room, below both."""
    most = (INNER_PX - LEFT_PX - GAP_PX - NOTES_PX, MAP_PX)
    scale = scale_for(page.area, most)
    right, bottom = MARGIN + LEFT_PX + page.area.width * scale, top + page.area.height * scale + BELOW_PX
    notes = NotesBlock(page.heading, page.notes, WIDTH - MARGIN - right - GAP_PX)
    notes_bottom = top + notes.height(1)
    legend, legend_top = LegendBlock(page.keys, right - MARGIN), bottom + SECTION_PX
    if not legend.fits or legend_top + legend.height > notes_bottom:
        legend, legend_top = LegendBlock(page.keys, INNER_PX), max(bottom, notes_bottom) + SECTION_PX
    return _Layout(WIDTH, most, legend, legend_top, notes, top, (right + GAP_PX,))


def place_tags(view: FloorView, page: Page) -> list[Box | None]:
    """Return the boxes of a page's numbers and names, none over another; None where there is no room."""
    left, top, right, bottom = view.frame
    inner = (left + 3, top + 3, right - 3, bottom - 3)
    kept = [(x - KEEP_PX, y - KEEP_PX, x + KEEP_PX, y + KEEP_PX) for x, y in view.all_at(page.keep)]
    points = view.all_at([tag.place for tag in page.tags])
    return place_boxes(points, [tag_size(tag) for tag in page.tags], inner, view.all_at(page.avoid), kept)


def _draw_tags(view: FloorView, page: Page) -> None:
    """Write numbers and names beside their places, with a line to the place."""
    placed = [(tag, box) for tag, box in zip(page.tags, place_tags(view, page), strict=True) if box]
    for tag, box in placed:
        at = view.at(tag.place)
        if tag.number:
            view.sheet.line([at, centre(box)], PAPER, 4.5)
        if tag.number or math.dist(at, centre(box)) > FAR_PX:
            view.sheet.line([at, centre(box)], tag.color, 1.5)
    for tag, box in placed:
        draw_tag(view.sheet, tag, box)
