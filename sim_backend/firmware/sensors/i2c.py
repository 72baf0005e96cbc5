"""The I2C bus of an input port, bit by bit. Source: docs/firmware.md section 7.

The firmware's end of the bus works in the interrupts of a timer: it moves the two wires, and the sensor's end follows.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence

from sim_backend.firmware.sensors.i2c_sensor import BYTE_BITS
from sim_backend.firmware.sensors.i2c_wires import Wires
from sim_backend.firmware.versions import Version

STEPS_PER_MS = 48_054_850 / 2048 / 1000
"""Timer interrupts per millisecond; two make a clock pulse."""

BUFFER = 16
"""Size of the firmware's buffers in bytes."""

_WRITE_PAUSE, _START_PAUSE, _TURN_PAUSE, _READ_PAUSE = 3, 2, 7, 2
"""Timer interrupts between two bytes written, from the second start on, from the read address to the first byte read,
and between two bytes read."""

_END = True
_PLACES = tuple(reversed(range(BYTE_BITS)))

Steps = Generator[None, None, None]
"""The steps of the firmware's end; every `yield` waits for the next interrupt of the timer."""


class I2CBus(Wires):
    """The bus of one port: the firmware's end of its wires.

    Reading and writing are apart, as a read that was cut short may continue without a write.
    """

    def __init__(self, version: Version) -> None:
        super().__init__()
        self._waits, self._ends_early, self._suspends = (
            version.waits_for_clock,
            version.ends_write_early,
            version.suspends_reads,
        )
        self._sending: Steps | None = None
        self._reading: Steps | None = None
        self._suspended: Steps | None = None
        self._bits_left = self._unread = self._place = 0
        self._turns = self._sent = self._waiting = self._acknowledged = self._bit_open = False
        self._restarted = self._clock_differs = self._goes_on = False
        self._buffer = bytearray(BUFFER)

    @property
    def busy(self) -> bool:
        """Whether interrupts have work to do."""
        return self._sending is not None or self._reading is not None

    @property
    def left(self) -> bytes:
        """The firmware's receive buffer: bytes that it has not taken."""
        return bytes(self._buffer)

    def begin(self, message: Sequence[int], rx_size: int, *, restarts: bool = True) -> None:
        """Start to write `message`, address first, and then to read, with a second start before it or without.

        A read that an earlier message did not reach follows a message without a read.
        """
        self.set_pin(0, self._clock_level)
        if self._sending is not None:  # that is cut short
            self.set_clock(True)
        self._suspend()
        if rx_size:
            self._unread, self._place, self._turns = rx_size, 0, restarts
            self._suspended, self._restarted = None, False
        elif self._restarted:
            self._turns = False
        self.sensor.prepare(self._unread)
        self._sent = self._acknowledged = self._waiting = self._goes_on = False
        self._sending = self._send(message)
        next(self._sending)

    def transfer(self, message: bytes, rx_size: int) -> bytes | None:
        """Write `message` and read at once, without the timer.

        Args:
            message: The address first.
            rx_size: Number of bytes to read, after a second start without a stop; 0 for none.

        Returns:
            The bytes read, or None if a byte was not acknowledged. A clock line held low hangs the firmware; here it
            gives None.
        """
        self._suspend()
        self.release()
        self.set_pin(0, True)
        self.set_pin(1, True)
        self.sensor.prepare(rx_size)
        self.set_data(False)
        data = bytearray()
        acknowledged = self.clock and all(map(self._put, message))
        if acknowledged and rx_size:
            if not message[0] & 1:  # otherwise the sensor is already sending
                self._put_bit(True)
                self.set_data(False)
                acknowledged = self._put(message[0] | 1)
            data.extend(self._get(last=left == 1) for left in range(rx_size if acknowledged else 0, 0, -1))
        self._stop_now()
        return bytes(data) if acknowledged else None

    def _put_bit(self, bit: bool) -> bool:
        """Let the clock line rise once; return the data line."""
        self.set_clock(False)
        self.set_data(bit)
        self.set_clock(True)
        return self.data

    def _put(self, byte: int) -> bool:
        """Write a byte; return whether it was acknowledged."""
        for place in _PLACES:
            self._put_bit(bool(byte >> place & 1))
        return not self._put_bit(True)

    def _get(self, *, last: bool) -> int:
        """Read a byte; all but the last are acknowledged."""
        byte = 0
        for _ in range(BYTE_BITS):
            byte = byte << 1 | self._put_bit(True)
        self._put_bit(last)
        return byte

    def _stop_now(self) -> None:
        self._put_bit(False)
        self.set_data(True)

    def interrupt(self) -> None:
        """Do the work of an interrupt of the timer."""
        if self._sending is not None:
            self._sending = self._step(self._sending)
        if self._reading is not None:
            self._reading = self._step(self._reading)

    def _step(self, steps: Steps) -> Steps | None:
        """Do the work of one interrupt; return the rest of the steps, None after the last one.

        A transfer is abandoned when the clock line differs, and ends when the line is high; a read is suspended there.
        """
        ended = next(steps, _END)
        if self._clock_differs:
            self._clock_differs = False
            if steps is self._reading:
                self._suspended = steps
            steps = self._wait_for_clock()
            ended = next(steps, _END)
        return None if ended else steps

    def stop(self) -> None:
        """Release both lines. Newer versions suspend a read after its bit; in older ones a transfer goes on unseen."""
        self.release()
        self._goes_on = not self._suspends
        if self._goes_on:
            return
        if self._reading is not None and self._bit_open:
            self._reading = self._step(self._reading)
            self.release()
        self._suspend()

    def abandon(self) -> None:
        """Leave the pins as they are; a transfer continues as in `stop`, and a stop does, too."""
        if self._suspends and self._reading is not None:
            self._suspend()

    def refuse(self) -> None:
        """Begin no message, as a line is low; if a transfer continues after `stop`, the data pin becomes an input."""
        if self._goes_on:
            self.free_data()

    def _suspend(self) -> None:
        """End the message, but keep the rest of a read for the end of the next message without one."""
        if self._reading is not None and not self._waiting:
            self._suspended = self._reading
        self._sending = self._reading = None

    def written(self) -> bool | None:
        """Return whether the message was written, or None while that is open."""
        if self._sending is None:
            return self._acknowledged and not self._turns
        if self._bits_left or not (self._sent or self._waiting):
            return None
        if self._waiting or not self._turns:
            return self._acknowledged
        return True if self._ends_early and self._acknowledged else None

    def received(self) -> bool | None:
        """Return whether the bytes were read, or None while that is open; without a request there are none to read."""
        if not self._unread and self._reading is None:
            return True
        refused = not (self._turns or self._acknowledged)
        return False if refused or not self.busy else None

    def read(self, count: int) -> bytes:
        """Take the bytes read out of the buffer."""
        data = bytes(self._buffer[:count])
        self._buffer[:count] = bytes(len(data))
        return data

    def _wait_for_clock(self) -> Steps:
        self._waiting = True
        self.set_clock(True)
        while not self.clock:
            yield
        self.free_data()
        self._waiting = False

    def _pulse(self) -> Steps:
        """Let the clock line rise at the next interrupt, and wait for the one after it."""
        yield
        yield from self._check_low()
        yield from self._high_pulse()

    def _high_pulse(self) -> Steps:
        """Let the clock line rise now, and wait for the next interrupt."""
        self._raise_clock()
        yield
        yield from self._check_high()

    def _raise_clock(self) -> None:
        self.set_clock(True)
        self._bit_open = True

    def _check_low(self) -> Steps:
        if self._waits and self.clock_high:
            self._clock_differs = True
            yield

    def _check_high(self) -> Steps:
        self._bit_open = False
        if self._waits and not self.clock:
            self._clock_differs = True
            yield

    def _send(self, message: Sequence[int]) -> Steps:
        """Write the bytes; only the first one must be acknowledged.

        The data line falls without effect if a read that continued without the clock pin has left that pin at low.
        """
        self.pull_data()
        self.set_clock(True)
        yield
        address = 0
        for place in range(len(message)):
            if place:
                yield from _pause(_WRITE_PAUSE)
                self.pull_data()
            yield from self._send_byte(message, place)
            if not place:
                address, self._acknowledged = message[place], not self.data
            self.set_clock(False)
            if not self._acknowledged:
                break
        self._sent = True
        if self._acknowledged and self._unread and not self._turns:
            self._reading = self._resume(self._suspended) if self._suspended else self._read()
            return
        yield from self._stop()
        if self._acknowledged and self._turns:
            yield from self._turn(address + 1 & 0xFF)

    def _send_byte(self, message: Sequence[int], place: int) -> Steps:
        """Write a byte, of which each bit is read when it is sent; end with the clock line high for the acknowledge."""
        for bits_left in _PLACES:
            self._bits_left = bits_left
            self.set_clock(False)
            self.set_data(bool(message[place] >> bits_left & 1))
            yield from self._pulse()
        self.set_clock(False)
        self.set_data(False)  # the sensor sees that level, also while the pin is an input
        self.free_data()
        yield from self._pulse()

    def _stop(self) -> Steps:
        self.pull_data()
        yield from self._pulse()
        self.set_data(True)

    def _turn(self, address: int) -> Steps:
        """Send a second start and the read address, and read."""
        yield
        self.set_clock(False)
        yield
        yield from self._pulse()
        self.pull_data()
        self._restarted = True
        yield from _pause(_START_PAUSE)
        self._restarted = self.clock or not self._waits
        yield from self._check_high()
        self.set_clock(False)
        self._bits_left = BYTE_BITS
        yield
        self._acknowledged = False
        yield from self._send_byte((address,), 0)
        self._acknowledged, self._turns = not self.data, False
        self.set_clock(False)
        if self._acknowledged:
            self._reading = self._read()
        else:  # the stop begins in this interrupt
            self.pull_data()
            yield from self._high_pulse()
            self.set_data(True)

    def _resume(self, reading: Steps) -> Steps:
        """Continue a read where it was suspended."""
        yield from _pause(_WRITE_PAUSE)
        self.set_data(True)
        yield from reading

    def _read_pause(self, steps: int) -> Steps:
        for _ in range(steps):
            yield
            yield from self._check_low()

    def _await_bits(self) -> None:
        """Free the data line with a high level, the acknowledge of a sensor that counts the bits of another byte."""
        self.free_data()
        self.set_data(True)

    def _read(self) -> Steps:
        """Read the requested bytes; all but the last are acknowledged."""
        self.pull_data()
        yield from self._read_pause(_TURN_PAUSE)
        self._await_bits()
        while self._unread:
            for bits_left in _PLACES:
                yield
                yield from self._check_low()
                self._raise_clock()
                yield
                yield from self._check_high()
                value = self._buffer[self._place] | self.data
                self._buffer[self._place] = value << 1 & 0xFF if bits_left else value
                self.set_clock(False)
            if self._unread > 1:
                self.pull_data()
            yield from self._pulse()
            self._unread -= 1
            self._place = (self._place + 1) % BUFFER
            self.set_clock(False)
            self._await_bits()
            if self._unread:
                yield from self._read_pause(_READ_PAUSE)
        yield
        self.set_clock(True)


def _pause(steps: int) -> Steps:
    for _ in range(steps):
        yield
