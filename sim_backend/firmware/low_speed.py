"""The low speed module: I2C transactions on the four input ports. Source: docs/firmware.md section 7.

Its quirks are kept: a ring of 16 bytes per port that counts modulo 16 (a read of 16 bytes is lost), retries that send
bytes from beyond the message, and an error that stays until the next write.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from firmware_protocol.enums import SensorType
from firmware_protocol.status import Status
from sim_backend.firmware.i2c import FRAME_STEPS, STEPS_PER_MS, TX_STEPS, I2CBus
from sim_backend.firmware.input import InputPort
from sim_backend.firmware.low_speed_ram import WRAP, from_send_buffer
from sim_backend.firmware.module import NEVER, Clock

RING = 16
"""Size of a port's buffers in bytes."""

RETRIES = 3
"""Number of retries when the address is not acknowledged."""

_TRY_MS = 2
_RESTART_STEPS, _RX_STEPS = 28, 20
"""Timer interrupts for the turn to reading, and per byte read."""


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


def transfer_ms(tx_size: int, rx_size: int) -> int:
    """Duration of a transaction in milliseconds."""
    steps = FRAME_STEPS + TX_STEPS * tx_size + (_RESTART_STEPS + _RX_STEPS * rx_size if rx_size else 0)
    return int(-(-steps // STEPS_PER_MS))


class _Plan(NamedTuple):
    """Outcome of a transaction: the addresses that fail, and the message that is acknowledged."""

    failures: list[int]
    message: bytes | None


class Channel:
    """One port's bus and buffers.

    Attributes:
        bus: The bus itself.
        state: See `ChannelState`.
        mode: See `ChannelMode`.
        error: See `ChannelError`.
        tx, rx: Buffers of 16 bytes.
        tx_size: Number of bytes to send.
        rx_size: Number of bytes to read after that.
        rx_in, rx_out: Positions in the receive ring.
        received: Number of bytes of the last read.
        due_ms: Pass of the next change of state.
    """

    def __init__(self) -> None:
        self.bus = I2CBus()
        self.state, self.mode, self.error = ChannelState.IDLE, ChannelMode.NONE, ChannelError.NONE
        self.tx, self.rx = bytes(RING), bytearray(RING)
        self.tx_size = self.rx_size = self.rx_in = self.rx_out = self.received = 0
        self.due_ms = NEVER
        self._plan = _Plan([], None)

    @property
    def ready(self) -> int:
        """Number of received bytes waiting; 16 look like none."""
        return (self.rx_in - self.rx_out) % RING

    @property
    def registers(self) -> tuple[int, int, int]:
        """Mode, state and error."""
        return self.mode, self.state, self.error

    def start(self, data: bytes, rx_size: int, now_ms: int) -> None:
        """Accept a message; the next pass sends it."""
        self.tx = data + self.tx[len(data) :]
        self.tx_size, self.rx_size = len(data), rx_size
        self.state, self.error = ChannelState.INIT, ChannelError.NONE
        self.due_ms = now_ms + 1

    def fetch(self) -> bytes:
        """Remove and return the waiting bytes."""
        count, first = self.ready, self.rx_out
        self.rx_out = self.rx_in
        return bytes(self.rx[(first + i) % RING] for i in range(count))

    def advance(self, now_ms: int, ram: bytes) -> None:
        """Make the next change of state; `ram` begins with the send buffer."""
        self.due_ms = NEVER
        if self.state == ChannelState.INIT:
            self._send(now_ms, ram)
        elif self.state == ChannelState.COMMUNICATING:
            self._finish(now_ms)
        elif self.state == ChannelState.DONE:
            self.state = ChannelState.IDLE

    def _send(self, now_ms: int, ram: bytes) -> None:
        if self.bus.stuck:
            self.state, self.error = ChannelState.ERROR, ChannelError.NOT_READY
            return
        self.state, self.mode = ChannelState.COMMUNICATING, ChannelMode.TRANSMITTING
        self._plan = plan = self._foresee(ram)
        if plan.message is not None and not self.tx_size:
            self.bus.pour_out(plan.message, now_ms)  # the port never finishes
            return
        busy = 0 if plan.message is None else transfer_ms(self.tx_size, self.rx_size)
        self.due_ms = now_ms + _TRY_MS * len(plan.failures) + busy

    def _foresee(self, ram: bytes) -> _Plan:
        """Try the address, then up to three times the bytes beyond the message."""
        size = self.tx_size or WRAP
        beyond = ram[self.tx_size : self.tx_size + size]
        failures: list[int] = []
        for message in (ram[:size], *(beyond,) * RETRIES):
            if self.bus.acknowledges(message[0]):
                return _Plan(failures, message)
            failures.append(message[0])
        return _Plan(failures, None)

    def _finish(self, now_ms: int) -> None:
        for address in self._plan.failures:
            self.bus.probe(address)
        if self._plan.message is None:
            self.state, self.error = ChannelState.ERROR, ChannelError.NO_ACKNOWLEDGE
            return
        for byte in self.bus.transfer(self._plan.message, self.rx_size):
            self.rx[self.rx_in] = byte
            self.rx_in = (self.rx_in + 1) % RING
        if self.rx_size:
            self.mode, self.received = ChannelMode.RECEIVED, self.rx_size
        self.state = ChannelState.DONE
        self.due_ms = now_ms + 1


class LowSpeedModule:
    """Four channels, one per input port; they run in parallel.

    Attributes:
        due_ms: See `Module`.
        channels: Ports 1 to 4.
    """

    def __init__(self, clock: Clock, inputs: Sequence[InputPort]) -> None:
        self.channels = [Channel() for _ in inputs]
        self.due_ms = NEVER
        self._clock, self._inputs = clock, inputs

    def run(self, now_ms: int) -> None:
        """Advance the channels that are due."""
        for index, channel in enumerate(self.channels):
            if channel.due_ms <= now_ms:
                channel.advance(now_ms, from_send_buffer(self.channels, index))
        self.due_ms = min(channel.due_ms for channel in self.channels)

    def status(self, port: int) -> Status:
        """Status of a port, 0..3, as `LSGetStatus` reports it."""
        if not self._configured(port):
            return Status.CHANNEL_NOT_CONFIGURED
        match self.channels[port].state:
            case ChannelState.IDLE:
                return Status.OK
            case ChannelState.ERROR:
                return Status.BUS_ERROR
            case _:
                return Status.PENDING

    def write(self, port: int, data: bytes, rx_size: int) -> bool:
        """Start a transaction; False if the port is busy or not configured, which is not checked after an error."""
        channel = self.channels[port]
        idle = channel.state == ChannelState.IDLE and self._configured(port)
        if not idle and channel.state != ChannelState.ERROR:
            return False
        channel.start(data, rx_size, self._clock.now_ms)
        self.due_ms = min(self.due_ms, channel.due_ms)
        return True

    def _configured(self, port: int) -> bool:
        settings = self._inputs[port]
        return settings.type in (SensorType.LOW_SPEED, SensorType.LOW_SPEED_9V) and not settings.invalid
