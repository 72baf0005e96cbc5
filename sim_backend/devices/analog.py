"""Analog sensors."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from firmware_protocol.enums import SensorType
from sim_backend.firmware.sensors.analog import FULL_SCALE, NORMALIZE

PRESSED = 183
"""Converter value of a pressed touch sensor: 2.2 kΩ against the brick's 10 kΩ; released it is an open circuit.
Source: docs/firmware.md section 6 (switch type) and LEGO's hardware developer kit."""

LOUDEST_DB = 90.0
"""Sound level that reads 100 %; the reading is proportional to the pressure. Source: LEGO's NXT user guide."""

_DARK_PERCENT, _LAMP_PERCENT = 30.0, 45.0
"""Reading of the light sensor with its lamp over a floor that reflects nothing, and the increase over a mirror; black
tape reads 32 %, white paper 68 %. Model."""

_SHADE = 0.3
"""Share of the room's light that reaches the floor under the sensor. Model."""


class AnalogInput:
    """Anything that puts a voltage on an input port.

    Args:
        reading: Returns the converter's value, 0..1023; values beyond are clipped.
    """

    def __init__(self, reading: Callable[[], int]) -> None:
        self._reading = reading

    def raw(self) -> int:
        """Return the converter's value now, 0..1023."""
        return _clipped(self._reading())


class TouchSensor(AnalogInput):
    """LEGO's touch sensor.

    Args:
        pressed: Whether it is pressed now.
    """

    def __init__(self, pressed: Callable[[], bool]) -> None:
        super().__init__(lambda: PRESSED if pressed() else FULL_SCALE)


class LightSensor(AnalogInput):
    """LEGO's light sensor for the NXT: a photo transistor and a red lamp. More light gives less voltage.

    Args:
        brightness_percent: Returns the reading, 0..100; see `reflected_percent`.
    """

    def __init__(self, brightness_percent: Callable[[], float]) -> None:
        super().__init__(lambda: raw_for(SensorType.LIGHT_ACTIVE, _normalized(brightness_percent())))


class SoundSensor(AnalogInput):
    """LEGO's sound sensor. More sound gives less voltage.

    Args:
        level_db: Returns the sound level.
    """

    def __init__(self, level_db: Callable[[], float]) -> None:
        def percent() -> float:
            return float(100.0 * 10.0 ** ((level_db() - LOUDEST_DB) / 20.0))

        super().__init__(lambda: raw_for(SensorType.SOUND_DB, _normalized(percent())))


class RcxTemperatureSensor(AnalogInput):
    """LEGO's analog temperature sensor of the RCX (9889), -20 to 70 °C.

    Source: docs/firmware.md section 6: full scale is 90 °C, from -20 °C on.

    Args:
        temperature_c: Returns the temperature.
    """

    def __init__(self, temperature_c: Callable[[], float]) -> None:
        super().__init__(lambda: raw_for(SensorType.TEMPERATURE, _normalized((temperature_c() + 20.0) / 0.9)))


def reflected_percent(red_percent: float, ambient_percent: float, *, lamp: bool) -> float:
    """Return the reading of a light sensor that looks at the floor.

    Args:
        red_percent: Red light that the floor reflects; the lamp is red.
        ambient_percent: Brightness of the room.
        lamp: Whether the lamp is on.
    """
    if lamp:
        return _DARK_PERCENT + _LAMP_PERCENT * red_percent / 100.0
    return shaded_percent(red_percent, ambient_percent)


def shaded_percent(reflected: float, ambient_percent: float) -> float:
    """Return the room's light that a floor of `reflected` percent reflects into the sensor above it."""
    return _SHADE * ambient_percent * reflected / 100.0


@cache
def raw_for(sensor_type: int, normalized: int) -> int:
    """Return the voltage of a sensor of this type.

    Args:
        sensor_type: A type that the firmware normalises.
        normalized: The normalized value, 0..1023.

    Returns:
        The converter's value, 0..1023, that the firmware normalises to the nearest value.
    """
    normalize = NORMALIZE[sensor_type]
    return min(range(FULL_SCALE + 1), key=lambda raw: abs(normalize(raw) - normalized))


def _normalized(percent: float) -> int:
    return _clipped(round(percent * FULL_SCALE / 100.0))


def _clipped(value: int) -> int:
    return min(max(value, 0), FULL_SCALE)
