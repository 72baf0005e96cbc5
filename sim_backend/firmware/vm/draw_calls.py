"""System calls that draw. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_protocol.status import Status
from sim_backend.firmware.display import COMBINATIONS
from sim_backend.firmware.vm.calls import Call, Function
from sim_backend.firmware.vm.pictures import DRAWN, draw_content

_CLEAR = 0x3
"""Bits of the options that clear the screen before drawing."""

_CLEARED = 1
"""Screen mode of firmware 1.32."""


def drawing(
    draw: Callable[[Call], int | None], options_at: int, *, combines: bool = True, fills: bool = False
) -> Function:
    """Return a call with options among its arguments; firmware 1.32 has more of them, see `DisplayModule.combine`."""

    def run(call: Call) -> None:
        options = call.number(options_at)
        call.devices.display.begin(clear=bool(options & _CLEAR), spend=call.spend_pixels)
        combined = combines and call.machine.dialect.enhanced_calls and options & COMBINATIONS
        if combined:
            call.devices.display.collect()
        status = draw(call)
        if combined:
            call.devices.display.combine(options, fills=fills)
        if status in (None, DRAWN):
            call.devices.display.show_drawing()
        call.put(0, status or Status.OK)

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


def _picture(call: Call) -> None:
    """Draw a picture file: status, point, file name, parameters, options.

    Firmware 1.32 leaves the screen as it is if the file cannot be opened.
    """
    enhanced = call.machine.dialect.enhanced_calls
    status, handle, file = call.devices.loader.open_block(call.text(2).decode("latin-1"))
    content = b"" if status or file is None else file.block
    call.devices.loader.close(handle)
    if status and enhanced:
        call.put(0, status)
        return

    def draw(call: Call) -> int:
        return status or draw_content(call, content)

    drawing(draw, 4, combines=False)(call)


def _screen_mode(call: Call) -> None:
    """Give the screen back, or clear it: status, mode 0 or 1."""
    if call.number(1) == 0:
        call.devices.display.release()
    elif call.number(1) == _CLEARED and call.machine.dialect.enhanced_calls:
        call.devices.display.clear()
    call.put(0, Status.OK)


TABLE: Mapping[int, Function] = {
    13: drawing(_text, 3, fills=True),
    14: drawing(_point, 2),
    15: drawing(_line, 3),
    16: drawing(_circle, 3, fills=True),
    17: drawing(_rectangle, 3, fills=True),
    18: _picture,
    19: _screen_mode,
}
"""Number of each call to its function."""
