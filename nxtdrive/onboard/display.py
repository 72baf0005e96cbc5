"""What the brick's display shows, as a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.iomap import DISPLAY, DISPLAY_HEIGHT, DISPLAY_WIDTH, DisplayFlag
from firmware_protocol.system import IOMapRead
from nxtdrive.link.protocol import RequestLink

Picture = NDArray[np.bool_]

LINES = DISPLAY_HEIGHT // 8
READ_HEADER = 9
"""Bytes of an IOMapRead reply in front of the data: 55 are left over USB, 119 over Bluetooth. Source: docs/firmware.md
section 2; a longer read is cut short by the firmware, with no error."""


class Display:
    """The display of a brick.

    Attributes:
        link: The way to the brick.
    """

    def __init__(self, link: RequestLink) -> None:
        self.link = link

    def image(self) -> Picture:
        """What is shown now: (64, 100), row 0 on top, true where a pixel is black.

        While a message covers the display, that is the message. The firmware takes 800 bytes in 15 reads over USB (some
        50 ms) and in 7 over Bluetooth; what a program draws meanwhile may be seen in part.

        Raises:
            LinkError: Lost, closed, or no answer in time.
            BrickError: The brick refused.
        """
        flags = DISPLAY.field("Flags")
        popup = flags.decode(self.link.request(flags.read()).data) & DisplayFlag.POPUP
        start = DISPLAY.field("Popup" if popup else "Normal").offset
        lines = np.frombuffer(self._read(start, LINES * DISPLAY_WIDTH), np.uint8).reshape(LINES, 1, DISPLAY_WIDTH)
        bits = np.arange(8, dtype=np.uint8).reshape(1, 8, 1)
        return (lines >> bits & 1).astype(bool).reshape(DISPLAY_HEIGHT, DISPLAY_WIDTH)

    def _read(self, start: int, size: int) -> bytes:
        portion = self.link.max_telegram - READ_HEADER
        offsets = range(start, start + size, portion)
        return b"".join(self._portion(offset, min(portion, start + size - offset)) for offset in offsets)

    def _portion(self, offset: int, size: int) -> bytes:
        return self.link.request(IOMapRead(DISPLAY.module_id, offset, size)).data[:size]
