"""Sensors to plug into the simulated brick: what they perceive comes from a function, what they say is LEGO's."""

from __future__ import annotations

from collections.abc import Callable

NO_ECHO = 255
"""What the ultrasonic sensor says when nothing answers."""

_OPEN, _PRESSED = 1023, 183
"""Converter values of the touch sensor: open circuit, and 2.2 kΩ against the brick's 10 kΩ.
Source: docs/firmware.md section 6 (switch type) and LEGO's hardware developer kit."""


_ULTRASONIC_CONSTANTS = {
    0x00: b"V1.0\0\0\0\0",
    0x08: b"LEGO\0\0\0\0",
    0x10: b"Sonar\0\0\0",
    0x11: b"\x00",  # factory zero
    0x12: b"\x01",  # factory scale factor
    0x13: b"\x0e",  # factory scale divisor
    0x14: b"10E-2m\0",
    0x40: b"\x01",  # interval between measurements
    0x50: b"\x00",  # actual zero, scale factor and divisor
    0x51: b"\x01",
    0x52: b"\x0e",
}
"""Registers of the ultrasonic sensor that never change; several of them lie inside each other's text."""


class AnalogInput:
    """Anything that makes a voltage.

    Args:
        reading: The converter's value now, 0..1023.
    """

    def __init__(self, reading: Callable[[], int]) -> None:
        self._reading = reading

    def raw(self) -> int:
        """The converter's value now, 0..1023."""
        return min(max(self._reading(), 0), _OPEN)


class TouchSensor:
    """LEGO's touch sensor.

    Args:
        pressed: Whether somebody presses it now.
    """

    def __init__(self, pressed: Callable[[], bool]) -> None:
        self._pressed = pressed

    def raw(self) -> int:
        """The converter's value now."""
        return _PRESSED if self._pressed() else _OPEN


class GenericI2CDevice:
    """A device of 256 registers with an address pointer that counts on, as most I2C sensors have.

    Args:
        address: Its 8-bit write address.

    Attributes:
        address: As given.
        registers: What it holds.
    """

    def __init__(self, address: int = 0x02) -> None:
        self.address = address
        self.registers = bytearray(256)
        self._pointer = 0

    def write(self, data: bytes) -> None:
        """Take the register number, then bytes to put there."""
        if not data:
            return
        self._pointer = data[0]
        for byte in data[1:]:
            self.registers[self._pointer] = byte
            self._pointer = (self._pointer + 1) % 256

    def read(self, size: int) -> bytes:
        """Give bytes from the pointer on."""
        data = bytes(self.registers[(self._pointer + i) % 256] for i in range(size))
        self._pointer = (self._pointer + size) % 256
        return data


class UltrasonicSensor:
    """LEGO's ultrasonic sensor. Source of its registers: LEGO's hardware developer kit, appendix on the sensor.

    Args:
        distance_cm: Distance of the nearest echo now, or None without one.

    Attributes:
        address: Its 8-bit write address.
    """

    ADDRESS = 0x02
    OFF, SINGLE_SHOT, CONTINUOUS, EVENT_CAPTURE, WARM_RESET = range(5)
    """What can be written to the mode register."""

    _MODE, _DISTANCES = 0x41, range(0x42, 0x4A)

    def __init__(self, distance_cm: Callable[[], int | None]) -> None:
        self.address = self.ADDRESS
        self._distance_cm = distance_cm
        self._pointer = 0
        self._mode = self.CONTINUOUS
        self._echoes = bytes([NO_ECHO] * len(self._DISTANCES))

    def write(self, data: bytes) -> None:
        """Take the register number, and a command if it is the mode register."""
        if not data:
            return
        self._pointer = data[0]
        if self._pointer == self._MODE and len(data) > 1:
            self._command(data[1])

    def read(self, size: int) -> bytes:
        """Give bytes from the register on; the distance is measured now if the sensor runs by itself."""
        if self._pointer == self._MODE:
            data = bytes([self._mode])
        elif self._pointer in self._DISTANCES:
            if self._mode == self.CONTINUOUS:
                self._measure()
            data = self._echoes[self._pointer - self._DISTANCES.start :]
        else:
            data = _ULTRASONIC_CONSTANTS.get(self._pointer, b"")
        return data[:size].ljust(size, b"\0")

    def _command(self, mode: int) -> None:
        if mode == self.WARM_RESET:
            mode = self.CONTINUOUS
        self._mode = mode
        if mode in (self.SINGLE_SHOT, self.EVENT_CAPTURE):
            self._measure()

    def _measure(self) -> None:
        distance = self._distance_cm()
        nearest = NO_ECHO if distance is None else min(max(distance, 0), NO_ECHO)
        self._echoes = bytes([nearest]) + bytes([NO_ECHO] * (len(self._DISTANCES) - 1))
