"""The receiver of the high speed port: two buffers that fill as bytes arrive, and what a pass takes from them.

Source: docs/firmware.md section 5.2 (Comm map).
"""

from __future__ import annotations

_LINE = 4096
"""Bytes that the line keeps at most."""
_SIZE = 128
"""Bytes of each of the two buffers."""


class HighSpeedReceiver:
    """Two buffers that take bytes from the line in turn, also while the port is closed.

    Attributes:
        initialised: Whether state 1 was ever executed. Otherwise a buffer that the firmware has read is not used again:
            bytes still count, but are lost.
    """

    def __init__(self) -> None:
        """Make a receiver that takes nothing yet: bytes wait on the line."""
        self.initialised = False
        self._line = bytearray()
        self._buffers = bytearray(_SIZE), bytearray(_SIZE)
        self._filled, self._following = self._buffers
        self._room = self._following_room = 0
        self._read = self._taken = 0

    def set_up(self) -> None:
        """Lose what the buffers hold, and begin with the first one."""
        self._filled, self._following = self._buffers
        self._room = self._following_room = _SIZE
        self._read = self._taken = 0
        self._fill()

    def arrive(self, data: bytes) -> None:
        """Add bytes to the line, from which the buffers take them at once."""
        self._line += data[: _LINE - len(self._line)]
        self._fill()

    @property
    def is_idle(self) -> bool:
        """Whether passes change nothing until bytes arrive."""
        return self._following_room > 0 and self._taken == _SIZE - self._room

    def take(self) -> bytes:
        """Take, in one pass, what is new in a buffer, and give it back if the other one is in use."""
        in_use = self._following_room == 0
        end = _SIZE if in_use else _SIZE - self._room
        data = bytes(self._buffers[self._read][self._taken : end])
        self._taken = end
        if in_use:
            self._following = self._buffers[self._read] if self.initialised else bytearray(_SIZE)
            self._following_room = _SIZE
            self._read, self._taken = 1 - self._read, 0
            self._fill()
        return data

    def _fill(self) -> None:
        """Move bytes from the line to the buffers.

        The following one comes in use when the first is full, or, if it was given back only then, with the next byte.
        """
        while self._line:
            if not self._room:
                if not self._following_room:
                    return
                self._switch()
            size, place = min(self._room, len(self._line)), _SIZE - self._room
            self._filled[place : place + size] = self._line[:size]
            del self._line[:size]
            self._room -= size
            if not self._room and self._following_room:
                self._switch()

    def _switch(self) -> None:
        self._filled, self._room, self._following_room = self._following, self._following_room, 0
