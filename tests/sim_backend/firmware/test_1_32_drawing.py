"""Lines and options of drawings in firmware 1.32, as it drew them. See docs/firmware.md sections 8.5 and 8.6."""

import pytest

from sim_backend.firmware.display import DisplayModule


def black(display):
    return {(x, y) for x in range(100) for y in range(64) if display.get(x, y)}


def line(*ends, enhanced=True):
    display = DisplayModule(enhanced=enhanced)
    display.line(*ends)
    return black(display)


@pytest.mark.parametrize(
    ("ends", "first", "last"),
    [
        ((61, 111, 97, -3), (76, 63), (97, 0)),
        ((-36, 64, 17, -14), (0, 11), (8, 0)),
        ((84, 111, -10, 19), (0, 28), (35, 63)),
        ((-26, 13, 120, -25), (0, 7), (24, 0)),
        ((-58, -35, 59, 74), (0, 19), (48, 63)),
        ((47, 114, 38, -21), (39, 0), (44, 63)),
    ],
)
def test_lines_are_cut_off_at_the_edges_first(ends, first, last):
    drawn = line(*ends)
    assert {first, last} <= drawn
    assert drawn == line(*first, *last)


@pytest.mark.parametrize("ends", [(-50, 102, 41, 65), (70, -2, 127, -17), (-5, 10, -1, 40), (120, 3, 100, 60)])
def test_lines_beyond_an_edge_are_left_out(ends):
    assert line(*ends) == set()


def test_lines_are_drawn_from_left_to_right():
    assert line(15, 4, 34, 28) == line(34, 28, 15, 4)
    assert line(15, 4, 34, 28, enhanced=False) != line(34, 28, 15, 4, enhanced=False)


BAR = {(x, 10) for x in range(5, 15)}


def combined(options, *, fills=False, draw=lambda display: display.line(10, 5, 10, 15)):
    display = DisplayModule(enhanced=True)
    display.line(5, 10, 14, 10)
    display.collect()
    draw(display)
    display.combine(options, fills=fills)
    return black(display)


UPRIGHT = {(10, y) for y in range(5, 16)}


@pytest.mark.parametrize(
    ("options", "drawn"),
    [
        (0x00, BAR | UPRIGHT),
        (0x04, BAR - UPRIGHT),
        (0x08, BAR),
        (0x0C, BAR - UPRIGHT),
        (0x10, BAR | UPRIGHT),
        (0x14, BAR),
        (0x18, BAR ^ UPRIGHT),
        (0x1C, BAR),
        (0x20, BAR | UPRIGHT),
    ],
)
def test_drawings_are_combined_with_what_is_there(options, drawn):
    assert combined(options) == drawn


def test_shapes_can_be_filled():
    drawn = combined(0x20, fills=True, draw=lambda display: display.rectangle(30, 20, 4, 3))
    assert drawn - BAR == {(x, y) for x in range(30, 35) for y in range(20, 24)}


@pytest.mark.parametrize("size", [(50, 37), (-30, 8), (120, -5), (9, 100)])
def test_a_rectangle_is_filled_up_to_the_edges_of_the_screen(size):
    corner = -23, 29
    drawn = combined(0x20, fills=True, draw=lambda display: display.rectangle(*corner, *size))
    columns, rows = (
        range(max(min(start, start + length), 0), min(max(start, start + length), last) + 1)
        for start, length, last in zip(corner, size, (99, 63), strict=True)
    )
    assert drawn - BAR == {(x, y) for x in columns for y in rows} - BAR


@pytest.mark.parametrize("ends", [(102, 50, 94, 88), (115, 22, 99, 64), (-2, 61, 2, 68)])
def test_an_end_that_a_truncated_slope_leaves_above_the_screen_is_far_below_it(ends):
    column = 0 if ends[0] < 0 else 99
    assert line(*ends) == {(column, y) for y in range(64)}


@pytest.mark.parametrize("ends", [(109, 62, 72, 67), (101, 62, 97, 66)])
def test_a_line_that_is_beyond_a_side_once_its_top_is_cut_off_is_left_out(ends):
    assert line(*ends) == set()
