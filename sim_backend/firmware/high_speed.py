"""The high speed link, RS485 on port 4, as far as telegrams see it: a poll buffer.

Source: docs/firmware.md section 5 (0xA1, 0xA2) and 5.2 (Comm map).
"""

from __future__ import annotations

_UPDATE = 1
_INITIALISE = 1
_CAPACITY = 128


class HighSpeed:
    """What arrived on port 4 and was not fetched.

    Attributes:
        flags: As in the comm map; bit 0 asks the firmware to look at `state`.
        state: As in the comm map; 1 opens the receiver.
    """

    def __init__(self) -> None:
        self.flags = self.state = 0
        self._waiting = b""

    @property
    def waiting(self) -> int:
        """Bytes not yet fetched."""
        return len(self._waiting)

    def arrive(self, data: bytes) -> None:
        """Take bytes from the wire; lost while the receiver is closed, or the buffer full."""
        if self.flags & _UPDATE and self.state == _INITIALISE:
            self._waiting = (self._waiting + data)[:_CAPACITY]

    def fetch(self, size: int) -> bytes:
        """Take up to `size` bytes out of the buffer."""
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data
