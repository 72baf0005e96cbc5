"""Sensors that make a voltage."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from firmware_protocol.enums import SensorType
from sim_backend.firmware.analog import FULL_SCALE, NORMALIZE

_PRESSED = 183
"""Converter value of the touch sensor: 2.2 kΩ against the brick's 10 kΩ; released it is an open circuit.
Source: docs/firmware.md section 6 (switch type) and LEGO's hardware developer kit."""

LOUDEST_DB = 90.0
"""Where the sound sensor reads 100 %; the reading grows with the pressure. Source: LEGO's user guide of the NXT set."""

_DARK_PERCENT, _LAMP_PERCENT = 30.0, 45.0
"""What the light sensor reads with its lamp over a floor that throws nothing back, and how much more over a mirror:
black tape reads 32 %, white paper 68 %. Model."""

_SHADE = 0.3
"""How much of the room's light comes under the sensor. Model."""


class AnalogInput:
    """Anything that makes a voltage.

    Args:
        reading: The converter's value now, 0..1023.
    """

    def __init__(self, reading: Callable[[], int]) -> None:
        self._reading = reading

    def raw(self) -> int:
        """The converter's value now, 0..1023."""
        return _clipped(self._reading())


class TouchSensor:
    """LEGO's touch sensor.

    Args:
        pressed: Whether somebody presses it now.
    """

    def __init__(self, pressed: Callable[[], bool]) -> None:
        self._pressed = pressed

    def raw(self) -> int:
        """The converter's value now."""
        return _PRESSED if self._pressed() else FULL_SCALE


class LightSensor:
    """LEGO's light sensor for the NXT: a photo transistor and a red lamp.

    Args:
        brightness_percent: What it would read now, 0..100; see `reflected_percent`.
    """

    def __init__(self, brightness_percent: Callable[[], float]) -> None:
        self._brightness_percent = brightness_percent

    def raw(self) -> int:
        """The converter's value now; more light makes less voltage."""
        return raw_for(SensorType.LIGHT_ACTIVE, _normalized(self._brightness_percent()))


def reflected_percent(red_percent: float, ambient_percent: float, *, lamp: bool) -> float:
    """What a light sensor reads that looks at the floor.

    Args:
        red_percent: How much red light the floor throws back; the lamp is red.
        ambient_percent: How bright the room is.
        lamp: Whether the lamp is on.
    """
    if lamp:
        return _DARK_PERCENT + _LAMP_PERCENT * red_percent / 100.0
    return shaded_percent(red_percent, ambient_percent)


def shaded_percent(reflected: float, ambient_percent: float) -> float:
    """How much of the room's light a sensor gets back from the floor under it, which reflects `reflected` percent."""
    return _SHADE * ambient_percent * reflected / 100.0


class SoundSensor:
    """LEGO's sound sensor.

    Args:
        level_db: How loud it is now.
    """

    def __init__(self, level_db: Callable[[], float]) -> None:
        self._level_db = level_db

    def raw(self) -> int:
        """The converter's value now; more sound makes less voltage."""
        return raw_for(SensorType.SOUND_DB, _normalized(100.0 * 10.0 ** ((self._level_db() - LOUDEST_DB) / 20.0)))


class RcxTemperatureSensor:
    """LEGO's analog temperature sensor of the RCX (9889), -20 to 70 °C.

    Args:
        temperature_c: How warm it is now.
    """

    def __init__(self, temperature_c: Callable[[], float]) -> None:
        self._temperature_c = temperature_c

    def raw(self) -> int:
        """The converter's value now. Source: docs/firmware.md section 6: full scale is 90 °C, from -20 °C on."""
        return raw_for(SensorType.TEMPERATURE, _normalized((self._temperature_c() + 20.0) / 0.9))


@cache
def raw_for(sensor_type: int, normalized: int) -> int:
    """The voltage that a sensor of this type is built to make.

    Args:
        sensor_type: One that the firmware normalises.
        normalized: What the firmware is to read, 0..1023.

    Returns:
        The converter's value, 0..1023, that comes nearest.
    """
    normalize = NORMALIZE[sensor_type]
    return min(range(FULL_SCALE + 1), key=lambda raw: abs(normalize(raw) - normalized))


def _normalized(percent: float) -> int:
    return _clipped(round(percent * FULL_SCALE / 100.0))


def _clipped(value: int) -> int:
    return min(max(value, 0), FULL_SCALE)
