"""Drawing of programs into the frame buffer, each picture as LEGO's firmware drew it. See docs/firmware.md 8.5."""

import pytest

from firmware_protocol import direct
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.display import DisplayModule
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.firmware.vm.rxe import Type

CALL, FOREVER = 0x28, [0x4025, 0]
POINT, SCREEN_MODE = 14, 19
LETTERS = """
#...#.......#...#.
#...#.......#...#.
#...#..###...#.#..
#####.....#...#...
#...#..####..#.#..
#...#.#...#.#...#.
#...#..####.#...#.
..................
"""
RADIUS_4 = {(0, 4), (1, 4), (2, 3), (3, 2), (3, 3), (4, 0), (4, 1)}


def pixels(display):
    """Coordinates of the black pixels, from the bottom left."""
    return {
        (i % 100, 63 - i // 100 * 8 - bit)
        for i, byte in enumerate(display.pixels)
        for bit in range(8)
        if byte >> bit & 1
    }


def picture(display, columns, rows):
    black = pixels(display)
    return "\n".join("".join(".#"[(x, y) in black] for x in columns) for y in rows)


def drawn(method, *arguments):
    display = DisplayModule()
    getattr(display, method)(*arguments)
    return pixels(display)


def test_a_text_is_drawn_with_the_fonts_glyphs_into_its_line():
    display = DisplayModule()
    display.text(0, 5, b"H\x01aX")
    assert picture(display, range(18), range(7, -1, -1)) == LETTERS.strip()


@pytest.mark.parametrize(
    ("x", "y", "last"), [(93, 0, 97), (94, 0, None), (-1, 0, None), (0, -1, None), (0, 64, None), (0, 63, 4)]
)
def test_a_text_outside_of_the_screen_is_not_drawn(x, y, last):
    assert max((x for x, _ in drawn("text", x, y, b"H")), default=None) == last


def test_a_long_text_ends_at_the_edge():
    assert max(drawn("text", 0, 0, b"H" * 20))[0] == 94


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ((0, 0, 4, 2), {(0, 0), (1, 1), (2, 1), (3, 2), (4, 2)}),
        ((4, 2, 0, 0), {(4, 2), (3, 1), (2, 1), (1, 0), (0, 0)}),
        ((98, 62, 102, 66), {(98, 62), (99, 63)}),
    ],
)
def test_lines_depend_on_their_direction_and_are_clipped(line, expected):
    assert drawn("line", *line) == expected


def test_a_circle_is_the_midpoint_algorithms():
    circle = {(x - 50, y - 30) for x, y in drawn("circle", 50, 30, 4)}
    assert {(x, y) for x, y in circle if x >= 0 and y >= 0} == RADIUS_4
    assert circle == {(-x, y) for x, y in circle} == {(x, -y) for x, y in circle}
    assert drawn("circle", 5, 5, 0) == {(5, 5)}


@pytest.mark.parametrize(("size", "count"), [((0, 0), 1), ((1, 1), 4), ((5, 0), 6), ((-5, 3), 16), ((200, 10), 189)])
def test_a_rectangle_is_an_outline(size, count):
    assert len(drawn("rectangle", 10, 20, *size)) == count


def test_a_program_that_draws_takes_and_gives_back_the_screen():
    variables = Variables()
    cluster, _ = variables.call(0, 1)
    content = assemble(variables, [instruction(CALL, SCREEN_MODE, cluster), FOREVER])
    brick = SimBrick()
    store(brick, "a.rxe", content)
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(20)
    brick.display.begin(clear=False, spend=lambda _: None)
    brick.display.point(5, 6)
    assert pixels(brick.display) == {(5, 6)}
    brick.receive(direct.StopProgram().encode())
    brick.tick(3)
    assert pixels(brick.display) == set()


def test_the_first_drawing_clears_the_screen_and_later_ones_by_option():
    display = DisplayModule()
    display.point(1, 1)
    for clear, expected in ((False, {(2, 2)}), (False, {(2, 2), (3, 3)}), (True, {(4, 4)})):
        display.begin(clear=clear, spend=lambda _: None)
        display.point(*max(expected))
        assert pixels(display) == expected


@pytest.mark.parametrize(("options", "cleared"), [(0, False), (1, True), (2, True), (4, False), (0x8000, False)])
@pytest.mark.parametrize("firmware", FIRMWARES)
def test_two_bits_of_the_options_clear_the_screen(firmware, options, cleared):
    variables = Variables()
    lines = []
    for x, option in ((5, 0), (7, options)):
        variables.table.append((Type.CLUSTER, 0, 3))
        call = len(variables.table) - 1
        variables.number(0)
        variables.call(x, 6)
        variables.number(option)
        lines.append(instruction(CALL, POINT, call))
    content = assemble(variables, [*lines, FOREVER])
    brick = SimBrick(firmware=firmware)
    store(brick, "a.rxe", content)
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(30)
    white = firmware == "1.32" and options == 4
    assert pixels(brick.display) == (set() if cleared else {(5, 6)}) | (set() if white else {(7, 6)})


_STATUS_ICONS = "019401000a006c000400"


def test_the_status_bar_numbers_its_icons():
    bench = Bench(SimBrick())
    assert bench.telegram(_STATUS_ICONS)[18:] == "1a210c11"
    bench.control("!tick 500")
    assert bench.telegram(_STATUS_ICONS)[18:] == "1a210311"


@pytest.mark.parametrize(
    ("raw", "icon"),
    [(380, "0d"), (450, "0e"), (480, "0f"), (520, "10"), (560, "11"), (0x8000 | 520, "14"), (0x8000 | 600, "17")],
)
def test_the_status_bar_shows_the_bars_of_the_battery(raw, icon):
    bench = Bench(SimBrick())
    bench.control(f"!battery {raw}")
    bench.control("!tick 3000")
    assert bench.telegram(_STATUS_ICONS)[24:] == icon


def test_the_icon_of_an_empty_battery_alternates():
    bench, icons = Bench(SimBrick()), []
    bench.control("!battery 430")
    for _ in range(6):
        bench.control("!tick 166")
        icons.append(bench.telegram(_STATUS_ICONS)[24:])
    assert icons == ["0e", "0d"] * 3


def test_a_running_sign_that_is_off_stands_still():
    bench = Bench(SimBrick())
    bench.telegram("019501000c001d00010000")
    for _ in range(3):
        bench.control("!tick 400")
        assert bench.telegram(_STATUS_ICONS)[22:24] == "01"


def test_the_status_bar_is_drawn_with_every_sample_of_the_battery():
    bench = Bench(SimBrick())
    masks = [bench.telegram("019401000a0008000400")[18:] for _ in range(400)]
    assert [i for i, mask in enumerate(masks) if mask != "00000000"] == [12, 179, 346]
    assert set(masks) == {"00000000", "00800000"}


@pytest.mark.parametrize(
    ("draw", "same"),
    [
        (lambda display: display.point(300, -226), lambda display: display.point(44, 30)),
        (lambda display: display.circle(300, 30, 10), lambda display: display.circle(44, 30, 10)),
        (lambda display: display.circle(50, -240, 20), lambda display: display.circle(50, 16, 20)),
        (lambda display: display.line(90, 50, 390, 50), lambda display: display.line(0, 50, 99, 50)),
    ],
)
def test_pixels_have_coordinates_of_8_bits_but_not_in_1_32(draw, same):
    display, expected, later = DisplayModule(), DisplayModule(), DisplayModule(enhanced=True)
    draw(display)
    same(expected)
    assert display.pixels == expected.pixels
    draw(later)
    assert later.pixels != expected.pixels


@pytest.mark.parametrize("anywhere", [False, True])
@pytest.mark.parametrize("corner", [(328, 52), (-25071, 1), (-223, -20428)])
def test_texts_have_coordinates_of_8_bits(anywhere, corner):
    display, expected = DisplayModule(enhanced=anywhere), DisplayModule(enhanced=anywhere)
    display.text(*corner, b"abc", anywhere=anywhere)
    expected.text(corner[0] % 256, corner[1] % 256, b"abc", anywhere=anywhere)
    assert display.pixels == expected.pixels
    assert any(display.pixels)
