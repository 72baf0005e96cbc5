"""LEGO's colour sensor for the NXT (9694)."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.sensors.analog import FULL_SCALE
from sim_backend.firmware.sensors.color import BLANK

_DARKNESS = 71
"""Converter value in the dark, the zero of the firmware's scale. Source: docs/firmware.md section 6.1."""
_AMBIENT_STEPS, _LAMP_STEPS = 300, 500
"""Increase by full ambient light, and by a lamp over a mirror. Model."""
_ONE = 1 << 16


class ColorSensor:
    """A photodiode and three lamps that the brick switches.

    Args:
        reflected_percent: Returns the red, green and blue light that the floor reflects.
        ambient_percent: Returns the light without lamps.

    Attributes:
        calibration: Three equal rows of factors: the sensor is the same in bright and dark rooms.
        limits: Limits between the rows.
    """

    def __init__(
        self,
        reflected_percent: Callable[[], tuple[float, float, float]],
        ambient_percent: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self._reflected_percent, self._ambient_percent = reflected_percent, ambient_percent
        self.calibration = ((_ONE,) * 4,) * 3
        self.limits = (400, 200)

    def lit(self, lamp: int) -> int:
        """Return the converter's value, 0..1023, with a lamp on: red, green, blue or none."""
        value = _DARKNESS + _AMBIENT_STEPS * self._ambient_percent() / 100.0
        if lamp != BLANK:
            value += _LAMP_STEPS * self._reflected_percent()[lamp] / 100.0
        return min(max(round(value), 0), FULL_SCALE)

    def raw(self) -> int:
        """Return the reading of a port that is set to another type."""
        return self.lit(BLANK)
