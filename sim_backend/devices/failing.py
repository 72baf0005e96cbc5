"""Sensors that can fail while the robot drives."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from sim_backend.devices.analog import PRESSED
from sim_backend.devices.digital import NO_ECHO, UltrasonicSensor
from sim_backend.firmware.sensors.analog import FULL_SCALE
from sim_backend.firmware.sensors.color import ColorDevice
from sim_backend.firmware.sensors.i2c_sensor import I2CDevice
from sim_backend.firmware.sensors.input_port import AnalogSensor
from sim_backend.world.event_tables import Fault

NO_ADDRESS = 0x01
"""An I2C address that no request contains: write addresses are even."""
OPEN_CIRCUIT = FULL_SCALE
"""Converter value of a port without a sensor."""
LOST_SHARE = 0.5
"""Share of the requests that a loose plug loses. A guess."""

FaultNow = Callable[[], Fault | None]
"""How the sensor fails now; None if it works."""


def failing(sensor: AnalogSensor | I2CDevice, fault: FaultNow, random: Random) -> AnalogSensor | I2CDevice:
    """Return the sensor with failures.

    Args:
        sensor: The sensor; a colour sensor, which has its own protocol, never fails.
        fault: How it fails now.
        random: Draws the requests that a loose plug loses.
    """
    if isinstance(sensor, ColorDevice):
        return sensor
    if isinstance(sensor, I2CDevice):
        return FailingI2C(sensor, fault, random)
    return FailingAnalog(sensor, fault, random)


def _gone(fault: Fault | None, random: Random) -> bool:
    """Return whether the plug makes no contact now."""
    return fault == "unplugged" or (fault == "error" and random.random() < LOST_SHARE)


class FailingAnalog:
    """An analog sensor that fails at times.

    Args:
        sensor: The sensor.
        fault: How it fails now.
        random: Draws the readings that a loose plug loses.
    """

    def __init__(self, sensor: AnalogSensor, fault: FaultNow, random: Random) -> None:
        self._sensor, self._fault, self._random = sensor, fault, random
        self._last: int | None = None

    def raw(self) -> int:
        """Return the converter's value now, 0..1023."""
        fault = self._fault()
        if fault == "pressed":
            return PRESSED
        if _gone(fault, self._random):
            return OPEN_CIRCUIT
        if fault != "stuck" or self._last is None:
            self._last = self._sensor.raw()
        return self._last


class FailingI2C:
    """An I2C sensor that fails at times.

    Args:
        sensor: The sensor.
        fault: How it fails now.
        random: Draws the requests that a loose plug loses.
    """

    def __init__(self, sensor: I2CDevice, fault: FaultNow, random: Random) -> None:
        self._sensor, self._fault, self._random = sensor, fault, random
        self._register = 0
        self._last: dict[tuple[int, int], bytes] = {}
        self._was_read = False

    @property
    def address(self) -> int:
        """Its 8-bit write address; none while it does not answer."""
        return NO_ADDRESS if _gone(self._fault(), self._random) else self._sensor.address

    def write(self, data: bytes) -> None:
        """Set the register, and store what follows."""
        self._register = data[0] if data else self._register
        self._sensor.write(data)

    def read(self, size: int) -> bytes:
        """Read bytes from the register on."""
        fault, asked = self._fault(), (self._register, size)
        self._was_read = False
        if fault == "no_echo" and self._register in UltrasonicSensor.DISTANCES:
            return bytes([NO_ECHO] * size)
        if fault != "stuck" or asked not in self._last:
            self._last[asked] = self._sensor.read(size)
            self._was_read = True
        return self._last[asked]

    def give_back(self, count: int) -> None:
        """Return bytes to the sensor if they were its own."""
        if self._was_read:
            self._sensor.give_back(count)
