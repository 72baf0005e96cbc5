"""The high speed port, RS485 on input 4, as telegrams see it: a poll buffer.

Source: docs/firmware.md section 5 (0xA1, 0xA2) and 5.2 (Comm map).
"""

from __future__ import annotations

_UPDATE = 1
_INITIALISE = 1
_CAPACITY = 128


class HighSpeed:
    """Bytes that arrived on port 4 and were not fetched yet.

    Attributes:
        flags: As in the comm map; bit 0 makes the firmware check `state`.
        state: As in the comm map; 1 opens the receiver.
    """

    def __init__(self) -> None:
        self.flags = self.state = 0
        self._waiting = b""

    @property
    def waiting(self) -> int:
        """Number of bytes not yet fetched."""
        return len(self._waiting)

    def arrive(self, data: bytes) -> None:
        """Receive bytes; they are lost while the receiver is closed or the buffer is full."""
        if self.flags & _UPDATE and self.state == _INITIALISE:
            self._waiting = (self._waiting + data)[:_CAPACITY]

    def fetch(self, size: int) -> bytes:
        """Remove and return up to `size` bytes."""
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data
