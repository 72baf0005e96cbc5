"""The low speed module: I2C transactions on the four input ports. Source: docs/firmware.md section 7.

Its quirks are kept: a ring of 16 bytes per port that counts modulo 16 (a read of 16 bytes is lost), retries that send
bytes from beyond the message, and an error that stays until the next write.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import IntEnum, IntFlag

from firmware_protocol.enums import SensorType
from firmware_protocol.status import Status
from sim_backend.firmware.i2c import STEPS_PER_MS, I2CBus
from sim_backend.firmware.input import InputPort
from sim_backend.firmware.low_speed_ram import after_map_buffer, after_send_buffer
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.versions import Version

RING = 16
"""Size of a port's buffers in bytes."""

TRIES = 4
"""Number of times that a message is sent when the address is not acknowledged."""

READ_TIMEOUT = 100
"""Passes."""

_FIRST = 1
"""The bit of port 1."""

_LOW_SPEED = (SensorType.LOW_SPEED, SensorType.LOW_SPEED_9V)


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


class Option(IntFlag):
    """Options of LSWrite in firmware 1.32, as bits of the port."""

    NO_RESTART = 4
    AT_ONCE = 8


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

    def __init__(self, version: Version) -> None:
        self.bus = I2CBus(version)
        self._counts_full_ring = version.counts_full_ring
        self.state, self.mode, self.error = int(ChannelState.IDLE), int(ChannelMode.NONE), int(ChannelError.NONE)
        self.tx = self.rx = self.sending = bytes(RING)
        self.tx_size = self.tx_out = self.tx_spare = self.rx_size = self.rx_in = self.rx_out = self.received = (
            self.sent
        ) = 0
        self.failures = self.waited = 0

    @property
    def ready(self) -> int:
        """Number of received bytes waiting; see `Version.counts_full_ring` for 16."""
        waiting = self.rx_in - self.rx_out
        waiting += RING if waiting < 0 else 0
        full = not waiting and self.rx_size == RING and self.state == ChannelState.IDLE
        return RING if full and self._counts_full_ring else waiting & 0xFF

    def start(self, data: bytes, rx_size: int) -> None:
        """Accept a message."""
        self.tx = data + self.tx[len(data) :]
        self.tx_size, self.tx_out, self.rx_size = len(data), 0, rx_size
        self.state = ChannelState.INIT

    def reset(self) -> None:
        """Drop the transaction and the bytes waiting; the bus goes on."""
        self.state = ChannelState.IDLE
        self.tx_size = self.tx_out = self.rx_size = self.rx_in = self.rx_out = 0

    def initialize(self) -> None:
        """Prepare for the first attempt."""
        self.state, self.error, self.failures = ChannelState.LOAD, ChannelError.NONE, 0
        self.bus.stop()

    def fetch(self) -> bytes:
        """Take the bytes waiting."""
        first, count = self.rx_out, self.ready
        self.rx_out = self.rx_in
        return bytes(self.rx[(first + i) % RING] for i in range(min(count, RING)))  # the map may announce more

    def take(self) -> None:
        """Take the bytes of the next attempt out of the send buffer."""
        self.sent = self.tx_size
        self.tx_out = self.tx_out + self.tx_size & 0xFF

    def _account(self) -> None:
        if self.rx_size:
            self.waited = 0
        self.take()

    def begin(self, message: Iterable[int], *, restarts: bool) -> None:
        """Send a message; `restarts`: with a second start before a read."""
        self._account()
        self.bus.begin(message, self.rx_size, restarts=restarts)
        self.state, self.mode = ChannelState.COMMUNICATING, ChannelMode.TRANSMITTING

    def transfer(self, message: bytes) -> None:
        """Send a message and read at once, in one attempt."""
        if not message:
            self.state, self.error = ChannelState.ERROR, ChannelError.NO_MESSAGE
            return
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
        """Follow the transfer: retry it, turn to reading, or finish."""
        if self.mode == ChannelMode.TRANSMITTING:
            self._follow_write()
        if self.mode == ChannelMode.RECEIVING:
            self.waited += 1
            received = self.bus.received()
            if received:
                self._finish(self.bus.read(self.rx_size))
            elif received is False or self.waited > READ_TIMEOUT:
                self.fail(ChannelError.RECEIVE)

    def _follow_write(self) -> None:
        written = self.bus.written()
        if written is False:
            self.failures += 1
            if self.failures >= TRIES:
                self.fail(ChannelError.NO_ACKNOWLEDGE)
            else:
                self.state = ChannelState.LOAD
        elif written and self.rx_size:
            self.mode, self.waited = ChannelMode.RECEIVING, 0
        elif written:
            self._finish(b"")

    def _finish(self, received: bytes) -> None:
        ring = bytearray(self.rx)
        for byte in received:
            ring[self.rx_in % RING] = byte
            self.rx_in = (self.rx_in + 1) % RING
        self.rx = bytes(ring)
        if received:
            self.received = len(received)
        self.state, self.mode = ChannelState.DONE, ChannelMode.RECEIVED


class LowSpeedModule:
    """Four channels, one per input port; they run in parallel.

    Attributes:
        due_ms: See `Module`.
        channels: Ports 1 to 4.
        active: A bit per port that has work; the module rests while all are 0.
        at_once: A bit per port whose transfers take one pass.
        no_restart: A bit per port that reads without a second start; the firmware obeys only that of port 1.
    """

    def __init__(self, clock: Clock, inputs: Sequence[InputPort], version: Version) -> None:
        self.channels = [Channel(version) for _ in inputs]
        self.due_ms = NEVER
        self.active = self.at_once = self.no_restart = self._passes = 0
        self._ticking = False
        self._clock, self._inputs = clock, inputs
        self._has_options, self._resends = version.write_options, version.resends_messages
        for port, channel in zip(inputs, self.channels, strict=True):
            port.pins = channel.bus

    def wake(self) -> None:
        """Run in the next pass: the map was written."""
        self.due_ms = self._clock.now_ms + 1

    def reset(self) -> None:
        """Drop all transactions; a bit of an idle port stays."""
        for index, channel in enumerate(self.channels):
            if channel.state != ChannelState.IDLE:
                self.active &= ~(1 << index)
            channel.reset()

    def run(self, now_ms: int) -> None:
        """Advance the channels by one pass, and the buses by the interrupts in it."""
        if self.active:
            for index, channel in enumerate(self.channels):
                if channel.state != ChannelState.IDLE:
                    self._advance(index, channel)
        self._ticking = self._ticking and bool(self.active)
        if self._ticking:
            self._passes += 1
            interrupts = int(self._passes * STEPS_PER_MS) - int((self._passes - 1) * STEPS_PER_MS)
            for channel in self.channels:
                if channel.bus.busy:
                    channel.bus.interrupt(interrupts)
        else:
            self._passes = 0
        self.due_ms = now_ms + 1 if self.active else NEVER

    def _advance(self, index: int, channel: Channel) -> None:
        match channel.state:
            case ChannelState.ERROR:
                self.active &= ~(1 << index)
            case ChannelState.DONE:
                channel.state = ChannelState.IDLE
                self.active &= ~(1 << index)
            case ChannelState.INIT | ChannelState.LOAD | ChannelState.COMMUNICATING if not self._low_speed(index):
                channel.state, channel.error = ChannelState.ERROR, ChannelError.NOT_READY
            case ChannelState.INIT if self._has_options and self.at_once >> index & 1:
                self._transfer(index, channel)
            case ChannelState.INIT:
                self._ticking = True
                channel.initialize()
            case ChannelState.LOAD:
                self._load(index, channel)
            case ChannelState.COMMUNICATING:
                channel.communicate()

    def _load(self, index: int, channel: Channel) -> None:
        """Send the bytes of the next attempt."""
        if self._resends:
            channel.tx_out = 0
        message = after_map_buffer(self.channels, self.active, index)
        channel.sending = (message + channel.sending[len(message) :])[:RING]
        if channel.bus.stuck:
            channel.take()
            channel.fail(ChannelError.NOT_READY)
            return
        restarts = not (self._has_options and self.no_restart & 1 << index == _FIRST)
        channel.begin(message or after_send_buffer(self.channels, lambda: self.active, index), restarts=restarts)

    def _transfer(self, index: int, channel: Channel) -> None:
        channel.tx_out = 0
        channel.transfer(after_map_buffer(self.channels, self.active, index))
        if channel.state == ChannelState.IDLE:
            self.active &= ~(1 << index)

    def status(self, port: int) -> Status:
        """Return the status of a port, 0..3, as `LSGetStatus` reports it."""
        if not self._configured(port):
            return Status.CHANNEL_NOT_CONFIGURED
        match self.channels[port].state:
            case ChannelState.ERROR:
                return Status.BUS_ERROR
            case ChannelState.INIT | ChannelState.LOAD | ChannelState.COMMUNICATING | ChannelState.DONE:
                return Status.PENDING
            case _:  # the firmware leaves the former bytes of its reply
                return Status.OK

    def write_port(self, port: int) -> int:
        """Return the port, 0..3, for this number in LSWrite; see `Version.write_options`."""
        return port % len(self.channels) if self._has_options else port

    def write(self, port: int, data: bytes, rx_size: int, options: int = 0) -> bool:
        """Start a transaction; False if the port is busy or not configured, which is not checked after an error.

        Args:
            port: 0..3.
            data: At most 16 bytes, the address first.
            rx_size: Number of bytes to read.
            options: Bits of `Option`; others are ignored.
        """
        channel = self.channels[port]
        idle = channel.state == ChannelState.IDLE and self._configured(port)
        if not idle and channel.state != ChannelState.ERROR:
            return False
        channel.start(data, rx_size)
        if self._has_options:
            self.at_once = _with_bit(self.at_once, port, bool(options & Option.AT_ONCE))
            self.no_restart = _with_bit(self.no_restart, port, bool(options & Option.NO_RESTART))
        self.active |= 1 << port
        self.wake()
        return True

    def error_at_once(self, port: int) -> int:
        """Execute a transaction that was just started with that option, as for programs; return 0 or its error."""
        channel = self.channels[port]
        if not (self._has_options and self.at_once >> port & 1 and self._low_speed(port)):
            return 0
        self._transfer(port, channel)
        return channel.error if channel.state == ChannelState.ERROR else 0

    def _low_speed(self, port: int) -> bool:
        return self._inputs[port].type in _LOW_SPEED

    def _configured(self, port: int) -> bool:
        return self._low_speed(port) and not self._inputs[port].invalid


def _with_bit(bits: int, place: int, value: bool) -> int:
    return bits | 1 << place if value else bits & ~(1 << place)
