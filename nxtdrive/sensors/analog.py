"""Analog sensors."""

from __future__ import annotations

import math

from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.errors import SensorTimeout
from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort, in_range
from nxtdrive.sensors.port import Sensor
from nxtdrive.sensors.reading import QuantitySensor

POLL_S = 0.02
"""Interval for polling a button; a press lasts about 0.1 s."""
FULL_SCALE = 1023
"""The firmware's normalised values range over 0..1023. Source: docs/firmware.md section 6."""


class Touch(Sensor, QuantitySensor[bool]):
    """The touch sensor: a button."""

    type = SensorType.SWITCH
    mode = SensorMode.BOOLEAN
    quantity = "pressed"

    @property
    def pressed(self) -> bool:
        """Whether the button is down."""
        return self.values().scaled == 1

    value = pressed

    def wait_for_press(self, timeout_s: float = math.inf) -> bool:
        """Wait until the button is pressed; if it is down already, it has to be released first.

        Args:
            timeout_s: Longest wait, seconds.

        Returns:
            Whether it was pressed in time.

        Raises:
            LocalProtocolError: `timeout_s` is not a number.
        """
        in_range("timeout_s", timeout_s, -math.inf, math.inf)
        link, end, was_down = self.link, self.link.now() + timeout_s, self.pressed
        while link.now() < end:
            link.sleep(POLL_S)
            down = self.pressed
            if down and not was_down:
                return True
            was_down = down
        return False


class Percentage(Sensor, QuantitySensor[float]):
    """A sensor whose values are percentages of its range."""

    unit = "%"

    @property
    def percent(self) -> float:
        """Percentage of the sensor's range, 0..100."""
        # the firmware's own percentage is rounded; the value behind it is ten times as fine
        return self.values().normalized * 100 / FULL_SCALE

    value = percent


class Light(Percentage):
    """The light sensor, lamp on for surfaces or off for ambient light; higher is brighter."""

    type = SensorType.LIGHT_ACTIVE
    quantity = "brightness"

    def __init__(self, link: Link, port: SensorPort, *, lamp: bool = True) -> None:
        super().__init__(link, port)
        self.lamp = lamp

    @property
    def lamp(self) -> bool:
        """Whether the red lamp is on; may be set."""
        return self.type is SensorType.LIGHT_ACTIVE

    @lamp.setter
    def lamp(self, on: bool) -> None:
        self._become(SensorType.LIGHT_ACTIVE if on else SensorType.LIGHT_INACTIVE)


class Sound(Percentage):
    """The sound sensor: loudness unweighted (dB), or weighted as by the human ear (dBA).

    100 percent is about 90 dB. Source: LEGO's user guide of the NXT set.
    """

    type = SensorType.SOUND_DB
    quantity = "loudness"

    def __init__(self, link: Link, port: SensorPort, *, dba: bool = False) -> None:
        super().__init__(link, port)
        self.dba = dba

    @property
    def dba(self) -> bool:
        """Whether the loudness is A-weighted; may be set, and then takes 0.3 s to settle."""
        return self.type is SensorType.SOUND_DBA

    @dba.setter
    def dba(self, on: bool) -> None:
        self._become(SensorType.SOUND_DBA if on else SensorType.SOUND_DB)


class RcxTemperature(Sensor, QuantitySensor[float]):
    """The temperature sensor of the RCX (9889)."""

    type = SensorType.TEMPERATURE
    mode = SensorMode.CELSIUS
    quantity, unit = "temperature", "°C"

    @property
    def celsius(self) -> float:
        """Temperature in steps of 0.1 °C, above -20 and up to 70.

        Raises:
            SensorTimeout: The value is that of an empty port, the lower end of the range.
        """
        values = self.values()
        if values.normalized == 0:
            raise SensorTimeout(
                f"the port {self.port} gives {values.scaled / 10:g} °C, as an empty one does.",
                remedy="Plug in the temperature sensor of the RCX, or name the port where it is.",
            )
        return values.scaled / 10

    value = celsius
