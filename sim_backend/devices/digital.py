"""I2C sensors."""

from __future__ import annotations

from collections.abc import Callable

NO_ECHO = 255
"""Reading of the ultrasonic sensor without an echo."""

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
"""Constant registers of the ultrasonic sensor; some lie inside the text of others."""


class GenericI2CDevice:
    """A device of 256 registers with an auto-increment pointer, like most I2C sensors.

    Args:
        address: Its 8-bit write address.

    Attributes:
        address: As given.
        registers: Content of the registers.
    """

    def __init__(self, address: int = 0x02) -> None:
        self.address = address
        self.registers = bytearray(256)
        self._pointer = 0

    def write(self, data: bytes) -> None:
        """Set the pointer to the first byte, then store the others."""
        if not data:
            return
        self._pointer = data[0]
        for byte in data[1:]:
            self.registers[self._pointer] = byte
            self._pointer = (self._pointer + 1) % 256

    def read(self, size: int) -> bytes:
        """Read bytes from the pointer on."""
        data = bytes(self.registers[(self._pointer + i) % 256] for i in range(size))
        self._pointer = (self._pointer + size) % 256
        return data

    def give_back(self, count: int) -> None:
        """Move the pointer back by bytes that were read but not sent."""
        self._pointer = (self._pointer - count) % 256


class UltrasonicSensor:
    """LEGO's ultrasonic sensor. Source of its registers: LEGO's hardware developer kit, appendix on the sensor.

    Args:
        distance_cm: Returns the distance of the nearest echo, or None without one; a fraction is dropped.

    Attributes:
        address: Its 8-bit write address.
    """

    address = 0x02
    OFF, SINGLE_SHOT, CONTINUOUS, EVENT_CAPTURE, WARM_RESET = range(5)
    """Values of the mode register."""

    DISTANCES = range(0x42, 0x4A)
    """Registers of the echoes."""

    _MODE = 0x41

    def __init__(self, distance_cm: Callable[[], float | None]) -> None:
        self._distance_cm = distance_cm
        self._pointer = 0
        self._mode = self.CONTINUOUS
        self._echoes = bytes([NO_ECHO] * len(self.DISTANCES))

    def write(self, data: bytes) -> None:
        """Set the register, and the mode if it is the mode register."""
        if not data:
            return
        self._pointer = data[0]
        if self._pointer == self._MODE and len(data) > 1:
            self._command(data[1])

    def read(self, size: int) -> bytes:
        """Read bytes from the register on; in continuous mode the distance is measured now."""
        if self._pointer == self._MODE:
            data = bytes([self._mode])
        elif self._pointer in self.DISTANCES:
            if self._mode == self.CONTINUOUS:
                self._measure()
            data = self._echoes[self._pointer - self.DISTANCES.start :]
        else:
            data = _ULTRASONIC_CONSTANTS.get(self._pointer, b"")
        return data[:size].ljust(size, b"\0")

    def give_back(self, count: int) -> None:
        """Do nothing: only a write moves the register."""

    def _command(self, mode: int) -> None:
        if mode == self.WARM_RESET:
            mode = self.CONTINUOUS
        self._mode = mode
        if mode in (self.SINGLE_SHOT, self.EVENT_CAPTURE):
            self._measure()

    def _measure(self) -> None:
        distance = self._distance_cm()
        nearest = NO_ECHO if distance is None else int(min(max(distance, 0), NO_ECHO))
        self._echoes = bytes([nearest]) + bytes([NO_ECHO] * (len(self.DISTANCES) - 1))


class Compass:
    """HiTechnic's compass sensor (NMC1034). Source of its registers: HiTechnic's data sheet.

    Args:
        heading_deg: Returns the direction of the sensor, clockwise from north.

    Attributes:
        address: Its 8-bit write address.
    """

    address = 0x02
    MEASURE = 0x00
    """Value of the mode register; with another, such as 0x43 for calibration, the heading is frozen."""

    _MODE, _HEADING = 0x41, 0x42
    _CONSTANTS = b"\xfdV1.23  HiTechncCompass "
    """Version, manufacturer and type from register 0 on, eight bytes each."""

    def __init__(self, heading_deg: Callable[[], float]) -> None:
        self._heading_deg = heading_deg
        self._device = GenericI2CDevice(self.address)
        self._device.registers[: len(self._CONSTANTS)] = self._CONSTANTS

    def write(self, data: bytes) -> None:
        """Set the register, and the mode if it is the mode register; the others are read-only."""
        self._device.write(data[: 1 + (data[:1] == bytes((self._MODE,)))])

    def read(self, size: int) -> bytes:
        """Read bytes from the register on: half degrees, the remainder, and degrees, low byte first."""
        registers = self._device.registers
        if registers[self._MODE] == self.MEASURE:
            degrees = round(self._heading_deg()) % 360
            measured = (degrees // 2, degrees % 2, *degrees.to_bytes(2, "little"))
            registers[self._HEADING : self._HEADING + len(measured)] = bytes(measured)
        return self._device.read(size)

    def give_back(self, count: int) -> None:
        """Move the register back by bytes that were read but not sent."""
        self._device.give_back(count)


class TemperatureSensor:
    """LEGO's digital temperature sensor for the NXT (9749), a TMP275. Source of its registers: TI's data sheet.

    Args:
        temperature_c: Returns the temperature, -55..127 °C.

    Attributes:
        address: Its 8-bit write address.
    """

    address = 0x98
    TEMPERATURE, CONFIGURATION, LOW, HIGH = range(4)
    """The registers; the configuration has one byte, the others two, high byte first."""
    SHUT_DOWN, ONE_SHOT = 0x01, 0x80
    """Bits of the configuration; bits 5 and 6 choose 9 to 12 bits of resolution."""

    def __init__(self, temperature_c: Callable[[], float]) -> None:
        self._temperature_c = temperature_c
        self._registers = {self.CONFIGURATION: b"\x00", self.LOW: b"\x4b\x00", self.HIGH: b"\x50\x00"}
        self._pointer = self.TEMPERATURE
        self._measure()

    def write(self, data: bytes) -> None:
        """Set the register, and its value if given."""
        if not data:
            return
        self._pointer = data[0] & 0x03
        if len(data) < 2 or self._pointer == self.TEMPERATURE:
            return
        if self._pointer == self.CONFIGURATION:
            self._configure(data[1])
        else:
            self._registers[self._pointer] = data[1:3].ljust(2, b"\0")

    def read(self, size: int) -> bytes:
        """Read the register, repeatedly; unless shut down, the sensor measures now."""
        if not self._registers[self.CONFIGURATION][0] & self.SHUT_DOWN:
            self._measure()
        return (self._registers[self._pointer] * size)[:size]

    def give_back(self, count: int) -> None:
        """Do nothing: only a write moves the register."""

    def _configure(self, value: int) -> None:
        self._registers[self.CONFIGURATION] = bytes((value & ~self.ONE_SHOT,))
        if value & self.ONE_SHOT:
            self._measure()

    def _measure(self) -> None:
        step = 1 << 7 - (self._registers[self.CONFIGURATION][0] >> 5 & 0x03)
        value = min(max(round(self._temperature_c() * 256), -0x8000), 0x7FFF)
        self._registers[self.TEMPERATURE] = (value // step * step & 0xFFFF).to_bytes(2, "big")
