"""LEGO's colour sensor for the NXT (9694)."""

from __future__ import annotations

from typing import Literal

from firmware_protocol.enums import OpenEnum, SensorType
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.iomap import INPUT
from firmware_protocol.system import GetVersions
from nxtdrive.sensors.analog import FULL_SCALE
from nxtdrive.sensors.port import Sensor
from nxtdrive.sensors.reading import QuantitySensor

LAST_FIRMWARE_WITHOUT_COLOR = (1, 5)
"""Last firmware without colour sensors; 1.29 has them. Source: docs/firmware.md section 11."""

Lamp = Literal["red", "green", "blue", "off"]

_LAMPS = {
    "red": SensorType.COLOR_RED,
    "green": SensorType.COLOR_GREEN,
    "blue": SensorType.COLOR_BLUE,
    "off": SensorType.COLOR_NONE,
}


class Color(OpenEnum):
    """A colour as the firmware classifies it. Source: docs/firmware.md section 6.1."""

    BLACK = 1
    BLUE = 2
    GREEN = 3
    YELLOW = 4
    RED = 5
    WHITE = 6


class ColorSensor(Sensor, QuantitySensor[Color]):
    """The colour sensor; it lights its lamps in turn, or a single one like a light sensor.

    Changing between the two takes 0.4 s.
    """

    type = SensorType.COLOR_FULL
    quantity = "color"

    @property
    def color(self) -> Color:
        """Colour of the surface, best measured from about a centimetre."""
        self._become(SensorType.COLOR_FULL)
        return Color(self.values().scaled)

    value = color

    @property
    def rgb(self) -> tuple[int, int, int]:
        """Red, green and blue reflection, calibrated and without ambient light, each 0..1023."""
        self._become(SensorType.COLOR_FULL)
        self.values()
        spot = INPUT.field("ColorSensorRaw", self._input)
        red, green, blue, _blank = spot.decode(self.link.request(spot.read()).data)
        return red, green, blue

    def brightness_percent(self, lamp: Lamp = "red") -> float:
        """Measure the brightness with one lamp or none, 0..100."""
        if lamp not in tuple(_LAMPS):
            raise LocalProtocolError(f"lamp must be {', '.join(_LAMPS)}, not {lamp!r}.")
        self._become(_LAMPS[lamp])
        return self.values().normalized * 100 / FULL_SCALE

    def set_up(self) -> None:
        """Set the port's type and wait until the sensor has sent its calibration.

        Raises:
            LinkTimeout: The sensor does not send it.
            LocalProtocolError: The brick's firmware is too old for it.
        """
        firmware = self.link.request(GetVersions()).firmware
        if tuple(map(int, firmware.split("."))) <= LAST_FIRMWARE_WITHOUT_COLOR:
            raise LocalProtocolError(
                f"firmware {firmware} cannot read colour sensors.", remedy="Install LEGO's firmware 1.29 on the brick."
            )
        super().set_up()
