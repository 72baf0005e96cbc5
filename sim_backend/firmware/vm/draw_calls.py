"""System calls that draw. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_protocol.status import Status
from sim_backend.firmware.vm.calls import Call, Function
from sim_backend.firmware.vm.pictures import draw_picture

_CLEAR = 0x3
"""Bits of the options that clear the screen before drawing."""


def drawing(draw: Callable[[Call], int | None], options_at: int) -> Function:
    """A call with options as one of its arguments."""

    def run(call: Call) -> None:
        options = call.number(options_at)
        call.devices.display.begin(clear=bool(options & _CLEAR))
        call.put(0, draw(call) or Status.OK)

    return run


def _text(call: Call) -> None:
    """Draw a text: status, point, text, options."""
    call.devices.display.text(*call.pair(1), call.text(2), anywhere=call.machine.dialect.enhanced_calls)


def _point(call: Call) -> None:
    """Draw a pixel: status, point, options."""
    call.devices.display.point(*call.pair(1))


def _line(call: Call) -> None:
    """Draw a line: status, start, end, options."""
    call.devices.display.line(*call.pair(1), *call.pair(2))


def _circle(call: Call) -> None:
    """Draw a circle: status, centre, radius, options."""
    call.devices.display.circle(*call.pair(1), call.number(2) & 0xFF)


def _rectangle(call: Call) -> None:
    """Draw a rectangle: status, corner, size, options."""
    call.devices.display.rectangle(*call.pair(1), *call.pair(2))


def _picture(call: Call) -> int:
    """Draw a picture file: status, point, file name, parameters, options."""
    return draw_picture(
        call.devices.display,
        call.devices.loader,
        call.text(2),
        call.pair(1),
        call.numbers(3),
        enhanced=call.machine.dialect.enhanced_calls,
    )


def _screen_mode(call: Call) -> None:
    """Give the screen back: status, mode 0."""
    if call.number(1) == 0:
        call.devices.display.release()
    call.put(0, Status.OK)


TABLE: Mapping[int, Function] = {
    13: drawing(_text, 3),
    14: drawing(_point, 2),
    15: drawing(_line, 3),
    16: drawing(_circle, 3),
    17: drawing(_rectangle, 3),
    18: drawing(_picture, 4),
    19: _screen_mode,
}
"""Number of each call to its function."""
