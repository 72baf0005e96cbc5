"""Screenshots of the brick's display."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import RemoteProtocolError
from firmware_protocol.iomap import DISPLAY, DISPLAY_HEIGHT, DISPLAY_WIDTH, DisplayFlag
from firmware_protocol.system import IO_MAP_READ_HEADER, IOMapRead
from nxtdrive.link.link import Link
from nxtdrive.link.transfer import in_step, pieces

Pixels = NDArray[np.bool_]

LINES = DISPLAY_HEIGHT // 8


def read_display(link: Link) -> Pixels:
    """Read the display: (64, 100), row 0 on top, true where a pixel is black.

    This includes a message that covers the display. The 800 bytes take 15 reads over USB (about 50 ms) and 7 over
    Bluetooth, so a drawing that a program makes in that time may be incomplete.

    Raises:
        LinkError: The link is lost or closed, or there was no reply in time.
        BrickError: The brick refused.
        RemoteProtocolError: Replies got out of step, repeatedly.
    """
    return in_step(link, lambda: _read_pixels(link))


def _read_pixels(link: Link) -> Pixels:
    flags = DISPLAY.field("Flags")
    popup = flags.decode(link.request(flags.read()).data) & DisplayFlag.POPUP
    start, limit = DISPLAY.field("Popup" if popup else "Normal").offset, link.max_telegram - IO_MAP_READ_HEADER
    pixels = b"".join(_read(link, start + offset, size) for offset, size in pieces(LINES * DISPLAY_WIDTH, limit))
    link.request(flags.read())  # its reply is shorter than those before it
    lines = np.frombuffer(pixels, np.uint8).reshape(LINES, 1, DISPLAY_WIDTH)
    bits = np.arange(8, dtype=np.uint8).reshape(1, 8, 1)
    return (lines >> bits & 1).astype(bool).reshape(DISPLAY_HEIGHT, DISPLAY_WIDTH)


def _read(link: Link, offset: int, size: int) -> bytes:
    data = link.request(IOMapRead(DISPLAY.module_id, offset, size)).data
    if len(data) != size:
        raise RemoteProtocolError(f"{size} bytes of the display were asked for", data)
    return data
