"""The I2C bus between an input port and a digital sensor, clocked by a timer. Source: docs/firmware.md section 7."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from typing import Protocol, runtime_checkable

from sim_backend.firmware.versions import Version

STEPS_PER_MS = 48_054_850 / 2048 / 1000
"""Timer interrupts per millisecond; two make a clock pulse."""

_PHASE = STEPS_PER_MS % 1
"""The timer is started one pass before the first clock pulse."""

BUFFER = 16
"""Size of the firmware's buffers in bytes."""

BYTE_CLOCKS = 9
"""Clock pulses of one byte including its acknowledge."""

_CLOCK_STEPS = 2
_TX_STEPS, _RX_STEPS = 21, 20
"""Timer interrupts per byte written and read, with the pause after it."""

_STOP_STEPS = 18
"""Timer interrupts from the start of the last byte written to the stop."""

_RESTART_STEPS, _ADDRESS_STEPS, _FIRST_BYTE_STEPS = 2, 7, 31
"""Timer interrupts from the end of the bytes written to the pulse before the second start, to the read address, and to
the first byte read."""

_READ_ACKNOWLEDGE_STEPS = _ADDRESS_STEPS - _RESTART_STEPS + _CLOCK_STEPS * BYTE_CLOCKS - 1
"""Timer interrupts from that pulse to the acknowledge of the read address."""

_WRITTEN_STEPS, _TURNED_STEPS, _RECEIVED_STEPS = -3, 23, 30
"""Timer interrupts beyond those of the bytes until the firmware knows the end of a write, of a write before a read, and
of the read."""


_NEVER = 1 << 62


@runtime_checkable
class I2CDevice(Protocol):
    """A digital sensor."""

    @property
    def address(self) -> int:
        """Its address in the 8-bit write form, such as 0x02."""

    def write(self, data: bytes) -> None:
        """Receive the bytes after the address."""

    def read(self, size: int) -> bytes:
        """Return `size` bytes."""


class Transfer:
    """One message on the bus, and the reading after it.

    Attributes:
        message: The bytes written, the address first.
        rx_size: Number of bytes read after a second start.
        started_ms: The pass in which the first clock pulse begins.
        acknowledged: Whether a device acknowledged the address.
        received: The bytes of the device; None until the write has ended.
        fetched: Whether the firmware took them.
        refused: Whether the device did not acknowledge the second address.

    Args:
        visible_steps: See `Version.write_end_steps`.
    """

    def __init__(
        self, message: bytes, rx_size: int, started_ms: int, *, acknowledged: bool, visible_steps: int = 0
    ) -> None:
        self.message, self.rx_size, self.started_ms = message, rx_size, started_ms
        self._visible_steps = visible_steps
        self.acknowledged = acknowledged
        self._cut = self._stop = _NEVER
        self.refused = False
        self.received: bytes | None = None
        self.fetched = False

    @property
    def written_ms(self) -> int:
        """The pass in which the firmware sees the end of the write, or the missing acknowledge."""
        if not self.acknowledged:
            return self.started_ms + 1
        if self._stop < self.turning_step:
            return _NEVER
        if self.refused:
            return self._seen(_TURNED_STEPS)
        written = self._seen(_WRITTEN_STEPS)
        if not self.rx_size:
            return written
        late = self.steps(written - 1) - _TX_STEPS * len(self.message) - _WRITTEN_STEPS
        return written if late < self._visible_steps else self._seen(_TURNED_STEPS)

    @property
    def received_ms(self) -> int:
        """The pass in which the firmware sees the end of the read."""
        return _NEVER if self._stop < _NEVER else self._seen(_RECEIVED_STEPS + _RX_STEPS * self.rx_size)

    def _seen(self, steps: int) -> int:
        return self.started_ms + ceil((_TX_STEPS * len(self.message) + steps - _PHASE) / STEPS_PER_MS)

    def cut(self, now_ms: int) -> None:
        """Unplug the device: nothing that it would do after this pass happens."""
        self._cut = self.steps(now_ms)
        if self.rx_size and self._cut < self.turning_step + _READ_ACKNOWLEDGE_STEPS:
            self.refused = True

    def freeze(self, now_ms: int) -> None:
        """Stop the clock after this pass, for good."""
        self._stop = self.steps(now_ms)

    def resume(self, now_ms: int) -> None:
        """Let the clock go on: a write has failed, a read stays cut short."""
        if self._stop < self.turning_step:
            self.refused, self.started_ms = True, now_ms - self._seen(_TURNED_STEPS) + self.started_ms + 1
            self._stop = _NEVER

    def read(self) -> bytes:
        """The bytes that the firmware reads; after a cut there are only ones."""
        if self.received is None:
            return b"\xff" * self.rx_size
        first_bit = _TX_STEPS * len(self.message) + _FIRST_BYTE_STEPS + _CLOCK_STEPS + 1
        bits = ((self._cut - first_bit - _RX_STEPS * number) // _CLOCK_STEPS + 1 for number in range(self.rx_size))
        return bytes(byte | 0xFF >> min(max(sent, 0), 8) for byte, sent in zip(self.received, bits, strict=True))

    def unread(self, now_ms: int) -> Iterator[int]:
        """What the firmware has of the bytes at the end of a pass: whole bytes, and the bits of the next one."""
        first_bit = _TX_STEPS * len(self.message) + _FIRST_BYTE_STEPS + _CLOCK_STEPS
        for number, byte in enumerate(self.received or b""):
            bits = (self.steps(now_ms) - first_bit - _RX_STEPS * number) // _CLOCK_STEPS + 1
            if bits <= 0:
                return
            yield byte if bits >= 8 else byte >> 8 - bits << 1

    def steps(self, now_ms: int) -> int:
        """Timer interrupts until the end of a pass."""
        return min(int((now_ms + 1 - self.started_ms) * STEPS_PER_MS + _PHASE), self._stop)

    @property
    def turning_step(self) -> int:
        """The timer interrupt of the pulse before the second start."""
        return _TX_STEPS * len(self.message) + _RESTART_STEPS

    def progress(self, now_ms: int) -> tuple[list[str], int]:
        """The bus until the end of a pass: see `I2CBus.trace`, and the number of clock pulses."""
        steps, clocks, tokens = self.steps(now_ms), 0, []
        for start, pulses, name in self._events():
            if steps < start:
                break
            done = min((steps - start) // _CLOCK_STEPS, pulses)
            clocks += done
            end = start + _CLOCK_STEPS * pulses - 1
            if name and end <= (steps if name == "P" and self.refused else min(steps, self._cut)):
                tokens.append(name)
        return tokens, clocks

    def complete(self, now_ms: int) -> bool:
        """Whether the last clock pulse is over at the end of a pass."""
        tail = _RECEIVED_STEPS + _RX_STEPS * self.rx_size if self.rx_size else _WRITTEN_STEPS
        return not self.acknowledged or self.steps(now_ms) >= _TX_STEPS * len(self.message) + tail

    def clock_low(self, now_ms: int) -> bool:
        """Whether the clock line is low at the end of a pass: between bytes, and in the first half of a pulse."""
        low, steps = False, self.steps(now_ms)
        for start, pulses, name in self._events():
            if steps < start:
                break
            since = steps - start
            if pulses and since:
                low = since % _CLOCK_STEPS == 1 if since <= _CLOCK_STEPS * pulses else name != "P"
        return low

    def _events(self) -> Iterator[tuple[int, int, str]]:
        """When something happens on the bus: timer interrupt, clock pulses, and the token that it ends with."""
        yield 0, 0, "S"
        acknowledge = "a" if self.acknowledged else "n"
        tokens = [f"[{self.message[0]:02x}]{acknowledge}", *(f"{byte:02x}" for byte in self.message[1:])]
        begin = 0
        for number, token in enumerate(tokens if self.acknowledged else tokens[:1]):
            begin = _TX_STEPS * number
            yield begin, BYTE_CLOCKS, token
        yield begin + _STOP_STEPS, 1, "P"
        if self.rx_size and self.acknowledged:
            yield self.turning_step, 1, "S"
            begin = _TX_STEPS * len(self.message)
            yield begin + _ADDRESS_STEPS, BYTE_CLOCKS, f"[{self.message[0] | 1:02x}]a"
            if self.refused:
                yield begin + _ADDRESS_STEPS + _CLOCK_STEPS * BYTE_CLOCKS, 0, "P"
            else:
                yield from self._bytes_read(begin + _FIRST_BYTE_STEPS)

    def _bytes_read(self, begin: int) -> Iterator[tuple[int, int, str]]:
        """The bytes read; each is known to the sensor's end of the bus when the acknowledge before it ends."""
        for number, byte in enumerate(self.received or bytes(self.rx_size)):
            yield begin - (1 if number else 6), 0, f"r{byte:02x}"
            yield begin, BYTE_CLOCKS, ""
            begin += _RX_STEPS
        yield begin - _CLOCK_STEPS, 0, "N"
        yield begin - _CLOCK_STEPS, 1, ""


class I2CBus:
    """The bus of one port, with at most one device, as LEGO's cables allow.

    Attributes:
        device: The sensor, or None.
        stuck: Whether a line is held low.
        trace: Set to a list to record the bus: S start, [aa] address byte, a acknowledged, n not, xx byte written,
            rxx byte read, N last byte read, P stop.
        clocks: Clock pulses so far.
        transfer: The message on the bus, or None.
        left: Bytes in the firmware's receive buffer that it has not taken.
        visible_steps: See `Version.write_end_steps`.
    """

    def __init__(self, version: Version) -> None:
        self.waits_for_clock, self.visible_steps = version.waits_for_clock, version.write_end_steps
        self.device: I2CDevice | None = None
        self.stuck = False
        self.trace: list[str] | None = None
        self.clocks = 0
        self.transfer: Transfer | None = None
        self._unread = self._told = self._counted = 0
        self._delivered = self._clock_low = False
        self.left = bytes(BUFFER)

    def begin(self, message: bytes, rx_size: int, now_ms: int) -> Transfer:
        """Start to write `message`, address first, and then to read.

        A read that the write before did not come to, for want of an acknowledge, follows a message without a read.
        """
        acknowledged = self.device is not None and self.device.address == message[0] & 0xFE
        self._told = self._counted = 0
        self._delivered = False
        self._unread = rx_size or self._unread
        self.transfer = Transfer(
            message, self._unread, now_ms, acknowledged=acknowledged, visible_steps=self.visible_steps
        )
        return self.transfer

    def connect(self, device: I2CDevice | None, now_ms: int) -> None:
        """Connect a device after this pass, or none."""
        transfer = self.transfer
        if transfer is not None and transfer.acknowledged and device is not self.device:
            if transfer.steps(now_ms) >= transfer.turning_step:
                self.write()
                self._sample(transfer)
            transfer.cut(now_ms)
        self.device = device

    def hold_clock(self, held: bool, now_ms: int) -> None:
        """Hold the clock line low after this pass, or release it."""
        self.stuck = held
        if self.waits_for_clock and self.transfer is not None and self.transfer.acknowledged:
            (self.transfer.freeze if held else self.transfer.resume)(now_ms)

    def write(self) -> None:
        """Hand the message over to the device: its last byte was sent."""
        if self.transfer is not None and self.device is not None and not self._delivered:
            self.device.write(self.transfer.message[1:])
            self._delivered = True

    def read(self) -> bytes:
        """The bytes read, from the device or the pulled-up line.

        What is left in the buffer of a read whose end the firmware did not wait for shifts its lowest bit in first.
        """
        transfer = self.transfer
        if transfer is None:
            return b""
        self._sample(transfer)
        left, self.left = self.left, bytes(BUFFER)
        transfer.fetched = True
        return bytes(byte | (old & 1) << 7 for byte, old in zip(transfer.read(), left, strict=False))

    def _sample(self, transfer: Transfer) -> None:
        if transfer.received is None and self.device is not None:
            transfer.received = self.device.read(transfer.rx_size)

    def end(self, now_ms: int) -> None:
        """End the transfer in this pass, finished or not."""
        self.settle(now_ms - 1)
        transfer = self.transfer
        if transfer is None:
            return
        if transfer.acknowledged and transfer.steps(now_ms - 1) >= transfer.turning_step:
            self._unread = 0
            if not transfer.fetched:
                self.write()
                self._sample(transfer)
                left = bytes(transfer.unread(now_ms - 1))
                self.left = left + self.left[len(left) :]
        self._clock_low = not transfer.complete(now_ms - 1) and transfer.clock_low(now_ms - 1)
        self.transfer = None

    def release(self) -> None:
        """Let the clock line go high; after a transfer that was cut short that is one more pulse."""
        self.clocks += self._clock_low
        self._clock_low = False

    def settle(self, now_ms: int) -> None:
        """Record what has happened until the end of a pass."""
        if self.transfer is None:
            return
        transfer = self.transfer
        if self.trace is not None and transfer.acknowledged and transfer.steps(now_ms) >= transfer.turning_step:
            self.write()
            self._sample(transfer)
        tokens, clocks = transfer.progress(now_ms)
        self.clocks += clocks - self._counted
        if self.trace is not None:
            self.trace.extend(tokens[self._told :])
        self._told, self._counted = len(tokens), clocks
