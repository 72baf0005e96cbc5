"""The buffers of one port for I2C, and the state of its transaction. Source: docs/firmware.md section 7."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntEnum

from sim_backend.firmware.sensors.i2c import BUFFER, I2CBus
from sim_backend.firmware.versions import Version

TRIES = 4
"""Number of times that a message is sent when the address is not acknowledged."""

READ_TIMEOUT = 100
"""Passes."""

_LEAST_BYTES = 2
"""Least number of bytes of a transfer at once, with one for a read."""


class ChannelState(IntEnum):
    """State of a port's bus, as in the map."""

    IDLE = 0
    INIT = 1
    LOAD = 2
    COMMUNICATING = 3
    ERROR = 4
    DONE = 5


class ChannelMode(IntEnum):
    """Direction of the last transfer, as in the map."""

    NONE = 0
    TRANSMITTING = 1
    RECEIVING = 2
    RECEIVED = 3


class ChannelError(IntEnum):
    """Error of a port's bus, as in the map."""

    NONE = 0
    NOT_READY = 1
    NO_ACKNOWLEDGE = 2
    RECEIVE = 3
    NO_MESSAGE = 0xFC
    REFUSED = 0xFD


class Channel:
    """One port's bus and buffers.

    Attributes:
        bus: The bus itself.
        state: See `ChannelState`.
        mode: See `ChannelMode`.
        error: See `ChannelError`.
        tx, rx: Buffers of 16 bytes.
        tx_size: Number of bytes to send.
        tx_out: Position in the send buffer and beyond of the next bytes to send.
        rx_size: Number of bytes to read after that.
        rx_in, rx_out: Positions in the receive ring.
        tx_spare: Byte of the map without effect.
        sending: The last bytes sent, 16.
        sent: Size of the last message, as the RAM shows it.
        received: Number of bytes of the last read.
        waited: Number of passes that it took.
        failures: Number of attempts without an acknowledge.
    """

    def __init__(self, version: Version, store: Callable[[int, int], None], read_on: Callable[[int], bytes]) -> None:
        """Make the channel.

        Args:
            version: The firmware version.
            store: Stores a byte at a place of the map after the receive ring, counted from the ring's beginning.
            read_on: Takes a number of bytes out of the memory after the bus's receive buffer.
        """
        self.bus = I2CBus(version)
        self._store_behind, self._read_on = store, read_on
        self._counts_full_ring = version.counts_full_ring
        self.state, self.mode, self.error = int(ChannelState.IDLE), int(ChannelMode.NONE), int(ChannelError.NONE)
        self.tx = self.rx = bytes(BUFFER)
        self.sending = bytearray(BUFFER)
        self.tx_size = self.tx_out = self.tx_spare = self.rx_size = self.rx_in = self.rx_out = 0
        self.sent = self.received = self.waited = self.failures = 0

    @property
    def ready(self) -> int:
        """Number of received bytes waiting; see `Version.counts_full_ring` for 16."""
        waiting = self.rx_in - self.rx_out
        waiting += BUFFER if waiting < 0 else 0
        full = self.rx_in == self.rx_out and self.rx_size == BUFFER and self.state == ChannelState.IDLE
        return BUFFER if full and self._counts_full_ring else waiting & 0xFF

    def start(self, data: bytes, rx_size: int) -> None:
        """Accept a message."""
        self.tx = data + self.tx[len(data) :]
        self.tx_size, self.tx_out, self.rx_size = len(data), 0, rx_size
        self.state = ChannelState.INIT

    def reset(self) -> None:
        """Drop the transaction, which then counts as done, and the bytes waiting; the bus continues."""
        if self.state != ChannelState.IDLE:
            self.state = ChannelState.DONE
        self.tx_size = self.tx_out = self.rx_size = self.rx_in = self.rx_out = 0

    def initialize(self) -> None:
        """Prepare for the first attempt."""
        self.state, self.error, self.failures = ChannelState.LOAD, ChannelError.NONE, 0
        self.bus.stop()

    def fetch(self, count: int, memory: bytes) -> bytes:
        """Take at most 16 of the bytes waiting out of the map, from the receive ring on.

        If the map has put the pointer past the ring, it continues there without a wrap.
        """
        place, data = self.rx_out, bytearray()
        for _ in range(min(count, BUFFER)):
            place = place if place != BUFFER else 0
            data.append(memory[place])
            place += 1
        if count:
            self.rx_out = (self.rx_out + count) % BUFFER
        return bytes(data)

    def take(self) -> None:
        """Take the bytes of the next attempt out of the send buffer."""
        self.sent = self.tx_size
        self.tx_out = self.tx_out + self.tx_size & 0xFF

    def _account(self) -> None:
        if self.rx_size:
            self.waited = 0
        self.take()

    def begin(self, message: Sequence[int], *, restarts: bool) -> None:
        """Send a message; `restarts`: with a second start before a read."""
        self._account()
        self.bus.begin(message, self.rx_size, restarts=restarts)
        self.state, self.mode = ChannelState.COMMUNICATING, ChannelMode.TRANSMITTING

    def transfer(self, message: bytes) -> None:
        """Send a message and read at once, in one attempt; one byte is just the address of a read."""
        if len(message) + bool(self.rx_size) < _LEAST_BYTES:
            self.state, self.error = ChannelState.ERROR, ChannelError.NO_MESSAGE
            return
        if len(message) == 1:
            message = bytes([message[0] | 1])
        self._account()
        received = self.bus.transfer(message, self.rx_size)
        if received is None:
            self.state, self.error = ChannelState.ERROR, ChannelError.REFUSED
        else:
            self._finish(received)
            self.state = ChannelState.IDLE

    def fail(self, error: ChannelError) -> None:
        """Abandon the transaction."""
        self.bus.abandon()
        self.state, self.error = ChannelState.ERROR, error

    def communicate(self) -> None:
        """Continue the transfer: retry it, begin to read, or finish."""
        if self.mode == ChannelMode.TRANSMITTING:
            self._follow_write()
        if self.mode == ChannelMode.RECEIVING:
            self.waited = self.waited + 1 & 0xFF
            received = self.bus.received()
            if received is False or self.waited > READ_TIMEOUT:
                self.fail(ChannelError.RECEIVE)
            if received is not None:
                data = self.bus.read(self.rx_size)
                if received:  # even after the timeout, whose error stays
                    self._finish(data + self._read_on(self.rx_size - len(data)))

    def _follow_write(self) -> None:
        written = self.bus.written()
        if written is False:
            self.failures = self.failures + 1 & 0xFF
            if self.failures >= TRIES:
                self.fail(ChannelError.NO_ACKNOWLEDGE)
            else:
                self.state = ChannelState.LOAD
        elif written and self.rx_size:
            self.mode, self.waited = ChannelMode.RECEIVING, 0
        elif written:
            self._finish(b"")

    def _finish(self, received: bytes) -> None:
        for byte in received:
            place = self.rx_in
            if place < BUFFER:
                self.rx = self.rx[:place] + bytes((byte,)) + self.rx[place + 1 :]
            else:  # where the map may point
                self._store_behind(place, byte)
            self.rx_in = place + 1 if place + 1 < BUFFER else 0
        if received:
            self.received = len(received)
        self.state, self.mode = ChannelState.DONE, ChannelMode.RECEIVED
