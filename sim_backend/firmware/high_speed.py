"""The high speed port, RS485 on input 4, as telegrams see it: a poll buffer.

Source: docs/firmware.md section 5 (0xA1, 0xA2) and 5.2 (Comm map).
"""

from __future__ import annotations

from enum import IntEnum

from sim_backend.firmware.module import NEVER, Clock

_UPDATE = 1
_CAPACITY = 128
_OPENING_MS = 2
"""From the pass that opens the receiver to the first bytes that it takes."""
_ENDED = range(1, 7)
"""States that 1.32 ends as they are carried out."""
_KNOWN = 16
"""States from this one on it ends at once."""


class HighSpeedState(IntEnum):
    """State byte of the Comm map; another one does nothing."""

    INITIALISE = 1
    RECEIVE = 2
    EXIT = 4
    DONE = 6


class HighSpeed:
    """Bytes that arrived on port 4 and were not fetched yet."""

    def __init__(self, clock: Clock, *, ends_done: bool) -> None:
        """Make the port.

        Args:
            clock: The brick's time.
            ends_done: Whether the state becomes `DONE` as a request is carried out.
        """
        self._clock, self._ends_done = clock, ends_done
        self._flags = self._state = 0
        self._next_ms = clock.now_ms
        self._opened_ms = NEVER
        self._waiting = b""

    @property
    def flags(self) -> int:
        """As in the map; bit 0 requests what the state says, and is cleared when it is done."""
        self._settle()
        return self._flags

    @flags.setter
    def flags(self, flags: int) -> None:
        self._settle()
        self._flags, self._next_ms = flags, self._clock.now_ms

    @property
    def state(self) -> int:
        """As in the map, see `HighSpeedState`."""
        self._settle()
        return self._state

    @state.setter
    def state(self, state: int) -> None:
        self._settle()
        self._state, self._next_ms = state, self._clock.now_ms

    @property
    def waiting(self) -> int:
        """Number of bytes not yet fetched."""
        return len(self._waiting)

    def arrive(self, data: bytes) -> None:
        """Receive bytes; they are lost while the receiver is closed or the buffer is full."""
        self._settle()
        if self._clock.now_ms >= self._opened_ms + _OPENING_MS:
            self._waiting = (self._waiting + data)[:_CAPACITY]

    def fetch(self, size: int) -> bytes:
        """Remove and return up to `size` bytes."""
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data

    def _settle(self) -> None:
        """Carry out requests in the passes since then: initialising takes one, and asks for receiving in the next."""
        while self._next_ms < self._clock.now_ms and (self._flags & _UPDATE or self._unknown):
            if self._state == HighSpeedState.INITIALISE:
                self._state = int(HighSpeedState.RECEIVE)
            else:
                self._carry_out()
            self._next_ms += 1

    @property
    def _unknown(self) -> bool:
        """Whether the state is one that 1.32 ends at once, requested or not."""
        return self._ends_done and self._state >= _KNOWN

    def _carry_out(self) -> None:
        self._flags &= ~_UPDATE
        if self._state == HighSpeedState.RECEIVE:
            self._opened_ms = min(self._opened_ms, self._next_ms)
        elif self._state == HighSpeedState.EXIT:
            self._opened_ms = NEVER
        if self._ends_done and (self._state in _ENDED or self._unknown):
            self._state = int(HighSpeedState.DONE)
