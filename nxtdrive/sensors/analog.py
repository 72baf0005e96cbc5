"""Sensors that make a voltage."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.enums import SensorMode, SensorType
from nxtdrive.ports import SensorPort
from nxtdrive.sensors.port import Sensor
from nxtdrive.sensors.reading import Measuring

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

FULL_SCALE = 1023
"""The firmware's normalised values are 0..1023. Source: docs/firmware.md section 6."""


class Touch(Sensor, Measuring[bool]):
    """The touch sensor: a button."""

    type = SensorType.SWITCH
    mode = SensorMode.BOOLEAN
    quantity = "pressed"

    @property
    def pressed(self) -> bool:
        """Whether the button is down."""
        return self.values().scaled == 1

    @property
    def value(self) -> bool:
        """The same as `pressed`."""
        return self.pressed


class Light(Sensor, Measuring[float]):
    """The light sensor, with its red lamp on to look at a surface or off to look at the room."""

    type = SensorType.LIGHT_ACTIVE
    quantity, unit = "brightness", "%"

    def __init__(self, brick: Brick, port: SensorPort, *, lamp: bool = True) -> None:
        super().__init__(brick, port)
        self.lamp = lamp

    @property
    def lamp(self) -> bool:
        """Whether the red lamp is on; it may be switched."""
        return self.type is SensorType.LIGHT_ACTIVE

    @lamp.setter
    def lamp(self, on: bool) -> None:
        self._become(SensorType.LIGHT_ACTIVE if on else SensorType.LIGHT_INACTIVE)

    @property
    def percent(self) -> float:
        """Brightness, 0..100; more is brighter."""
        return _percent(self.values().normalized)

    @property
    def value(self) -> float:
        """The same as `percent`."""
        return self.percent


class Sound(Sensor, Measuring[float]):
    """The sound sensor: loudness as it is (dB), or as the ear weighs it (dBA)."""

    type = SensorType.SOUND_DB
    quantity, unit = "loudness", "%"

    def __init__(self, brick: Brick, port: SensorPort, *, dba: bool = False) -> None:
        super().__init__(brick, port)
        self.dba = dba

    @property
    def dba(self) -> bool:
        """Whether only what the ear hears counts; it may be switched, and then takes 0.3 s to settle."""
        return self.type is SensorType.SOUND_DBA

    @dba.setter
    def dba(self, on: bool) -> None:
        self._become(SensorType.SOUND_DBA if on else SensorType.SOUND_DB)

    @property
    def percent(self) -> float:
        """Loudness, 0..100; 100 is some 90 dB. Source: LEGO's user guide of the NXT set."""
        return _percent(self.values().normalized)

    @property
    def value(self) -> float:
        """The same as `percent`."""
        return self.percent


class RcxTemperature(Sensor, Measuring[float]):
    """The older set's temperature sensor (9889), with studs on its cable."""

    type = SensorType.TEMPERATURE
    mode = SensorMode.CELSIUS
    quantity, unit = "temperature", "°C"

    @property
    def celsius(self) -> float:
        """Temperature in steps of 0.1 °C, -20..70."""
        return self.values().scaled / 10

    @property
    def value(self) -> float:
        """The same as `celsius`."""
        return self.celsius


def _percent(normalized: int) -> float:
    """The firmware's own percent have no decimals; the value it makes them of is ten times as fine."""
    return normalized * 100 / FULL_SCALE
