"""The high speed port, RS485 on input 4: a poll buffer for telegrams and programs.

Source: docs/firmware.md sections 5 (0xA1, 0xA2) and 5.2 (Comm map).
"""

from __future__ import annotations

from enum import IntEnum

from sim_backend.firmware.command_link import CommandLink
from sim_backend.firmware.high_speed_receiver import HighSpeedReceiver
from sim_backend.firmware.module import Clock
from sim_backend.firmware.versions import Version

_UPDATE = 1
_RING = 128
"""Size of the buffer of the receiver; it counts modulo this."""
_ENDED = range(1, 7)
"""States that 1.32 ends as they are executed."""
_REMAINING = 16
"""In 1.32 states from this one on are numbers of bytes that still have to be sent, and ended at once."""


class HighSpeedState(IntEnum):
    """State byte of the Comm map; another one does nothing."""

    INITIALISE = 1
    RECEIVE = 2
    SEND = 3
    EXIT = 4
    ENABLE = 5
    DONE = 6


class HighSpeed:
    """Bytes that arrived on port 4 and were not fetched yet.

    Arriving bytes wait on the line until the receiver takes them, also from power-on to the first opening.

    Attributes:
        ring_out: Place in the ring of the next byte to fetch; the map can change it.
        to_send: Number of bytes in the buffer for bytes to send.
    """

    def __init__(self, clock: Clock, link: CommandLink, version: Version) -> None:
        """Make the port.

        Args:
            clock: The brick's time.
            link: The link of the current command.
            version: The firmware version.
        """
        self._clock, self._link = clock, link
        self._ends_done, self._fetch_modulus = version.ends_high_speed, version.high_speed_modulus
        self._flags = self._state = 0
        self._next_ms = clock.now_ms
        self._receiver, self._is_open = HighSpeedReceiver(), False
        self._ring, self._in, self.ring_out = bytearray(_RING), 0, 0
        self.to_send = self._sent = 0

    @property
    def _now_ms(self) -> int:
        """The last pass of the port: in each, it comes after a telegram over Bluetooth and before one over USB."""
        return self._clock.now_ms - (not self._link.follows_port)

    @property
    def flags(self) -> int:
        """As in the map; bit 0 requests the action of the state, and is cleared when that is done."""
        self._catch_up(self._now_ms)
        return self._flags

    @flags.setter
    def flags(self, flags: int) -> None:
        self._catch_up(self._now_ms)
        self._flags = flags

    @property
    def state(self) -> int:
        """As in the map, see `HighSpeedState`."""
        self._catch_up(self._now_ms)
        return self._state

    @state.setter
    def state(self, state: int) -> None:
        self._catch_up(self._now_ms)
        self._state = state

    @property
    def sent(self) -> int:
        """Place of the next byte to send in the buffer for bytes to send."""
        self._catch_up(self._now_ms)
        return self._sent

    @sent.setter
    def sent(self, place: int) -> None:
        self._sent = place

    def request(self, state: int) -> None:
        """Request the action of a state."""
        self.state = state
        self.flags |= _UPDATE

    @property
    def waiting(self) -> int:
        """Number of bytes not yet fetched."""
        return (self.ring_in - self.ring_out) % _RING

    @property
    def ring_in(self) -> int:
        """Place in the ring of the next byte to take from the line; the map can change it."""
        self._catch_up(self._now_ms)
        return self._in

    @ring_in.setter
    def ring_in(self, place: int) -> None:
        self._catch_up(self._now_ms)
        self._in = place

    @property
    def ring(self) -> bytes:
        """The ring of the bytes taken; they stay there when they are fetched."""
        self._catch_up(self._now_ms)
        return bytes(self._ring)

    @ring.setter
    def ring(self, content: bytes) -> None:
        self._ring[:] = content

    def arrive(self, data: bytes) -> None:
        """Receive bytes; the next opening loses those that its buffers have taken while it was closed."""
        self._catch_up(self._clock.now_ms - 1)
        self._receiver.arrive(data)

    def fetch(self, size: int) -> bytes:
        """Remove and return up to `size` bytes."""
        data = bytearray()
        if self.waiting:
            while len(data) < size and self.ring_out != self._in:
                data.append(self._ring[self.ring_out % _RING])
                self.ring_out = (self.ring_out + 1) % self._fetch_modulus
        return bytes(data)

    def _catch_up(self, until_ms: int) -> None:
        """Do the passes since then, as far as they change anything."""
        while self._next_ms <= until_ms and (self._is_requested or (self._is_open and not self._receiver.is_idle)):
            self._pass()
            self._next_ms += 1
        self._next_ms = max(self._next_ms, until_ms + 1)

    def _pass(self) -> None:
        """Execute the request, or take bytes. A place past the ring is followed by its first one."""
        if self._is_requested and self._execute():
            self._receiver.set_up()
        elif self._is_open:
            for byte in self._receiver.take():
                if self._in < _RING:
                    self._ring[self._in] = byte
                self._in = self._in + 1 if self._in + 1 < _RING else 0

    @property
    def remaining(self) -> int:
        """Number of bytes that still have to be sent, in 1.32."""
        return max(self.state - _REMAINING, 0)

    @property
    def _remains(self) -> bool:
        """Whether the state is a number of bytes, which 1.32 ends at once, requested or not."""
        return self._ends_done and self._state >= _REMAINING

    @property
    def _is_requested(self) -> bool:
        return bool(self._flags & _UPDATE or self._remains)

    def _execute(self) -> bool:
        """Execute the action of the state.

        Returns:
            Whether it sets up the receiver. Initialising does so, and requests receiving for the next pass.
        """
        if self._flags & _UPDATE and self._state == HighSpeedState.INITIALISE:
            self._receiver.initialised = True
            self._state = int(HighSpeedState.RECEIVE)
            return True
        self._flags &= ~_UPDATE
        opens = self._state == HighSpeedState.RECEIVE
        self._is_open = opens or (self._is_open and self._state != HighSpeedState.EXIT)
        if self._state == HighSpeedState.SEND:
            if self._ends_done:
                self._state = _REMAINING + self.to_send & 0xFF
            else:
                self._sent = self._sent + self.to_send & 0xFF
        if self._remains:
            self._sent, self._state = self.to_send, int(HighSpeedState.DONE)
        elif self._ends_done and self._state in _ENDED:
            self._state = int(HighSpeedState.DONE)
        return opens
