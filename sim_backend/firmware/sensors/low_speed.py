"""The low speed module: I2C transactions on the four input ports. Source: docs/firmware.md section 7.

Its quirks are kept: a ring of 16 bytes per port that counts modulo 16 (a read of 16 bytes is lost), retries that send
bytes from beyond the message, and an error that stays until the next write.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntFlag
from functools import partial

from firmware_protocol.enums import SensorType
from firmware_protocol.status import Status
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sensors.i2c import BUFFER, STEPS_PER_MS
from sim_backend.firmware.sensors.input_port import InputPort
from sim_backend.firmware.sensors.low_speed_channel import Channel, ChannelError, ChannelState
from sim_backend.firmware.sensors.low_speed_ram import (
    AfterSendBuffer,
    after_map_buffer,
    after_receive_ring,
    read_on,
    store_behind,
)
from sim_backend.firmware.versions import Version

_FIRST = 1
"""The bit of port 1."""

_LOW_SPEED = (SensorType.LOW_SPEED, SensorType.LOW_SPEED_9V)


class WriteOption(IntFlag):
    """Options of LSWrite in firmware 1.32, as bits of the port."""

    NO_RESTART = 4
    AT_ONCE = 8


class LowSpeedModule:
    """Four channels, one per input port; they run in parallel.

    Attributes:
        due_ms: See `Module`.
        channels: Ports 1 to 4.
        active: A bit per port that has work; the module rests while all are 0.
        at_once: A bit per port whose transfers take one pass.
        no_restart: A bit per port that reads without a second start; only that of port 1 has an effect.
    """

    def __init__(self, clock: Clock, inputs: Sequence[InputPort], version: Version) -> None:
        self.channels = channels = list[Channel]()
        for index in range(len(inputs)):
            channels.append(Channel(version, partial(store_behind, channels, index), partial(self._read_on, index)))
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
        """Drop all transactions: each counts as done in the next pass; the bit of an idle port stays."""
        for index, channel in enumerate(self.channels):
            if channel.state != ChannelState.IDLE:
                self.active |= 1 << index
                self.wake()
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
            buses = [channel.bus for channel in self.channels if channel.bus.busy]
            for _ in range(interrupts):  # the ports run in turn, as one may send a bit that another one has read
                for bus in buses:
                    bus.interrupt()
        else:
            self._passes = 0
        self.due_ms = now_ms + 1 if self.active or self._ticking else NEVER

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
        copied = message[:BUFFER]
        channel.sending[: len(copied)] = copied
        if channel.bus.stuck:
            channel.take()
            channel.bus.refuse()
            channel.state, channel.error = ChannelState.ERROR, ChannelError.NOT_READY
            return
        restarts = not (self._has_options and self.no_restart & 1 << index == _FIRST)
        data: Sequence[int] = message
        if not message:
            data = AfterSendBuffer(self.channels, lambda: self.active, index)
        elif len(message) <= BUFFER:
            data = memoryview(channel.sending)[: len(message)]  # later copies replace bytes not sent yet
        channel.begin(data, restarts=restarts)

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
            case _:  # the firmware leaves the former bytes in its reply
                return Status.OK

    def fetch(self, port: int, count: int) -> bytes:
        """Take at most 16 of the bytes that wait on a port, 0..3."""
        return self.channels[port].fetch(count, after_receive_ring(self.channels, self.active, port))

    def _read_on(self, index: int, count: int) -> bytes:
        return read_on(self.channels, self.active, index, count) if count > 0 else b""

    def write_port(self, port: int) -> int:
        """Return the port, 0..3, for this number in LSWrite; see `Version.write_options`."""
        return port % len(self.channels) if self._has_options else port

    def write(self, port: int, data: bytes, rx_size: int, options: int = 0) -> bool:
        """Start a transaction; False if the port is busy or not configured, which is not checked after an error.

        Args:
            port: 0..3.
            data: At most 16 bytes, the address first.
            rx_size: Number of bytes to read.
            options: Bits of `WriteOption`; others are ignored.
        """
        channel = self.channels[port]
        idle = channel.state == ChannelState.IDLE and self._configured(port)
        if not idle and channel.state != ChannelState.ERROR:
            return False
        self.send(port, data, rx_size)
        if self._has_options:
            self.at_once = _with_bit(self.at_once, port, bool(options & WriteOption.AT_ONCE))
            self.no_restart = _with_bit(self.no_restart, port, bool(options & WriteOption.NO_RESTART))
        return True

    def send(self, port: int, data: bytes, rx_size: int) -> None:
        """Start a transaction as in `write`, whatever the port does, as the user interface does."""
        self.channels[port].start(data, rx_size)
        self.active |= 1 << port
        self.wake()

    def take(self, port: int, count: int) -> bytes | None:
        """Take bytes of a port, 0..3, whether or not they wait there; None while it is busy or after an error."""
        idle = self.channels[port].state in (ChannelState.IDLE, ChannelState.DONE)
        return self.fetch(port, count) if idle else None

    def error_at_once(self, port: int) -> int | None:
        """Execute a transaction that was just started with that option, as for programs.

        Returns:
            0 or its error; None without the option.
        """
        channel = self.channels[port]
        if not (self._has_options and self.at_once >> port & 1 and self._low_speed(port)):
            return None
        self._transfer(port, channel)
        return channel.error if channel.state == ChannelState.ERROR else 0

    def _low_speed(self, port: int) -> bool:
        return self._inputs[port].type in _LOW_SPEED

    def _configured(self, port: int) -> bool:
        return self._low_speed(port) and not self._inputs[port].invalid


def _with_bit(bits: int, place: int, value: bool) -> int:
    return bits | 1 << place if value else bits & ~(1 << place)
