"""Axes, dashes and files of drawings."""

from __future__ import annotations

import io
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from firmware_protocol.errors import ConfigError
from nxtdrive.drawing.blocks import BODY, Note, Tag
from nxtdrive.drawing.floor_view import GRID, Area, Axes, FloorView, tick_mm
from nxtdrive.drawing.legend import SAMPLE_PX, Key, dot_sample, line_sample
from nxtdrive.drawing.page import MARGIN, NARROWEST, WIDTH, Page, draw_page
from nxtdrive.drawing.sheet import INK, PAPER, Sheet, dashes, encoded, text_width

AXES = Axes("x, m", "y, m", up=True)


def test_a_place_on_the_floor_is_at_its_scale_in_the_frame():
    view = FloorView(Sheet(400, 300), Area(-1000, -500, 1000, 500), AXES, (50, 20), (300, 250))
    assert view.frame == pytest.approx((50, 20, 350, 170))
    assert view.at((0, 0)) == pytest.approx((200, 95))
    assert view.at((1000, 500)) == pytest.approx((350, 170))


@pytest.mark.parametrize(("least", "step"), [(1, 1), (130, 200), (200, 200), (201, 500), (7000, 10000)])
def test_ticks_are_round_numbers(least, step):
    assert tick_mm(least) == pytest.approx(step)


def test_an_area_around_one_point_has_its_least_size():
    area = Area.around([(3000.0, 3000.0)], 100, 1600)
    assert (area.width, area.height) == (1600, 1600)
    assert area.holds((3000, 3000))
    assert not area.holds((5000, 3000))


def test_dashes_cover_their_share_of_a_line_around_corners():
    line = [(0.0, 0.0), (35.0, 0.0), (35.0, 65.0)]
    strokes = list(dashes(line, (6, 4)))
    drawn = sum(math.dist(one, other) for stroke in strokes for one, other in pairwise(stroke))
    assert drawn == pytest.approx(60)
    assert len(strokes) == 10


@pytest.mark.parametrize("size_mm", [(1000.0, 6000.0), (4000.0, 3000.0), (9000.0, 1500.0), (20.0, 20.0)])
@pytest.mark.parametrize("notes", [0, 1, 16])
def test_pages_of_every_shape_hold_their_notes(size_mm, notes):
    area = Area(0.0, 0.0, *size_mm)
    page = Page(
        "A title",
        "and what there is to say about it " * 8,
        area,
        AXES,
        lambda view: view.sheet.line(view.all_at([(0, 0), size_mm]), INK, 2, (5, 3)),
        [Key("line", line_sample(INK, 2)), Key("dot " * 40, dot_sample(3, INK))],
        "What happened",
        [Note(str(i), "it went out of view on the way there", ("→ wait",)) for i in range(notes)],
        [Tag((10.0, 10.0), str(i), INK) for i in range(notes)],
    )
    drawn = np.asarray(draw_page(page))
    assert drawn.shape[1] == WIDTH or not notes
    assert NARROWEST <= drawn.shape[1] <= WIDTH
    assert drawn.shape[0] < 1.5 * WIDTH
    edge = np.concatenate([drawn[:3].ravel(), drawn[-3:].ravel(), drawn[:, :3].ravel(), drawn[:, -3:].ravel()])
    assert edge.min() == 255, "nothing is cut off at the edges"


def test_the_legend_of_a_narrow_map_is_as_wide_as_its_words():
    places, words = [], "the robot, and where it faced at the start"
    notes = [Note(str(i), "it went out of view on the way there", ("→ wait",) * 2) for i in range(16)]
    key = Key(words, lambda _, at: places.append(at))
    area = Area(0.0, 0.0, 1000.0, 20000.0)
    drawn = np.asarray(draw_page(Page("A title", "", area, AXES, lambda view: None, [key], "Notes", notes)))
    ((sample_x, middle),) = places
    row = drawn[round(middle) - 8 : round(middle) + 8, round(sample_x) :].min(axis=(0, 2))
    assert np.flatnonzero(row < 200)[-1] == pytest.approx(SAMPLE_PX / 2 + 10 + text_width(words, BODY), abs=6)


def test_a_page_without_notes_ends_beside_its_map():
    drawn = np.asarray(draw_page(Page("A room", "", Area(0.0, 0.0, 4000.0, 3000.0), AXES, lambda view: None, [])))
    assert drawn[:, -2 * MARGIN :].min() < 255
    assert drawn.shape[1] < WIDTH


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".PNG", ".webp"])
def test_a_drawing_is_written_in_the_format_of_its_suffix(suffix):
    content = encoded(Sheet(30, 20).finished(), Path(f"x{suffix}"))
    assert Image.open(io.BytesIO(content)).size == (30, 20)


@pytest.mark.parametrize("name", ["map.txt", "map", "map."])
def test_an_unknown_format_is_refused_with_advice(name):
    with pytest.raises(ConfigError, match=r"\.png"):
        encoded(Sheet(3, 3).finished(), Path(name))


def test_every_line_of_the_grid_is_equally_dark():
    sheet = Sheet(900, 400)
    FloorView(sheet, Area(-130, 0, 2270, 900), AXES, (60.3, 20.7), (777.7, 333.3)).draw_grid()
    picture = np.asarray(sheet.finished())
    for middle in (picture[40:300, 300], picture[100, 70:800]):
        assert {tuple(map(int, pixel)) for pixel in middle} == {PAPER, GRID}
