"""Drawing calls that only firmware 1.32 has. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_protocol.iomap import DISPLAY_HEIGHT, DISPLAY_WIDTH
from firmware_protocol.status import Status
from sim_backend.firmware.cint import s16
from sim_backend.firmware.font import CELL_WIDTH, glyph
from sim_backend.firmware.vm.calls import Call, Function
from sim_backend.firmware.vm.data import Place
from sim_backend.firmware.vm.draw_calls import drawing
from sim_backend.firmware.vm.pictures import draw_content
from sim_backend.firmware.vm.shapes import draw_ellipse, draw_polygon

_DRAWS, _ERASES, _TURNS = range(3)
"""Values of the display function's switch; others draw."""

_TEXT_LINE = 8


def _picture_of_bytes(call: Call) -> int:
    """Draw a picture: status, point, its bytes, parameters, options."""
    return draw_content(call, call.content(2))


def _polygon(call: Call) -> None:
    """Draw a closed polygon: status, points, options."""
    data = call.machine.data
    corners = []
    for corner in data.parts(Place(call.members[1])):
        values = [int(data.get(part.entry, part.offset)) for part in data.parts(corner)]
        corners.append((s16(values[0]), s16(values[1])))
    draw_polygon(call.devices.display, corners, call.number(2))


def _ellipse(call: Call) -> None:
    """Draw an ellipse: status, centre, horizontal and vertical radius, options."""
    draw_ellipse(call.devices.display, *call.pair(1), call.number(2) & 0xFF, call.number(3) & 0xFF)


def _display_function(call: Call) -> None:
    """Execute a function of the display: status, function, switch, x, y, and two more numbers; y from the bottom."""
    display = call.devices.display
    display.take()
    function, switch, x, y, right, up = (call.number(position) & 0xFF for position in range(1, 7))
    ink = switch if switch in (_ERASES, _TURNS) else _DRAWS
    match function:
        case 0:
            display.clear()
        case 1:
            _fill(call, range(x, x + 1), range(y, y + 1), ink)
        case 2:
            _fill(call, range(min(x, right), max(x, right) + 1), range(y, y + 1), ink)
        case 3:
            _fill(call, range(x, x + 1), range(min(y, up), max(y, up) + 1), ink)
        case 4:
            _character(call, x, y, right, inverted=switch != _ERASES)
        case 5:
            top = DISPLAY_HEIGHT - 1 - _TEXT_LINE * x
            _fill(call, range(DISPLAY_WIDTH), range(top - _TEXT_LINE + 1, top + 1), _ERASES)
        case 6:
            _fill(call, range(x, x + right), range(y - up + 1, y + 1), ink)
        case 7:
            _fill(call, range(x, x + right), range(y, y + 1), ink)
            for column in (x, x + right - 1):
                _fill(call, range(column, column + 1), range(y - up + 1, y), ink)
    call.put(0, Status.OK)


def _fill(call: Call, columns: range, rows: range, ink: int) -> None:
    display = call.devices.display
    call.spend_pixels(len(columns) * len(rows))
    for y in rows:
        for x in columns:
            display.set(x, y, display.get(x, y) ^ 1 if ink == _TURNS else int(ink == _DRAWS))


def _character(call: Call, x: int, top: int, character: int, *, inverted: bool) -> None:
    """Draw a character; its place counts from the top left."""
    for column, bits in enumerate((glyph(character) or b"")[:CELL_WIDTH]):
        for row in range(_TEXT_LINE):
            call.devices.display.set(x + column, DISPLAY_HEIGHT - 1 - top - row, (bits >> row & 1) ^ inverted)


DRAWING: Mapping[int, Function] = {
    80: _display_function,
    92: drawing(_picture_of_bytes, 4, combines=False),
    93: drawing(_polygon, 2),
    94: drawing(_ellipse, 4, fills=True),
}
"""Number of each call to its function."""
