"""LEGO's ultrasonic sensor (9846).

Source of register numbers and "no echo": LEGO's Hardware Developer Kit, ultrasonic sensor I2C map.
"""

from __future__ import annotations

from nxtdrive.sensors.i2c import I2CSensor
from nxtdrive.sensors.reading import Measuring

_MODE, _DISTANCES = 0x41, 0x42
_SINGLE_SHOT, _CONTINUOUS = 0x01, 0x02
_ECHOES = 8
_NO_ECHO = 0xFF
_PING_S, _FIRST_DISTANCE_S = 0.05, 0.03
"""Time until distances are available, after a single shot and after the start of continuous measurement.
Source: leJOS NXJ, class UltrasonicSensor, DELAY_DATA_PING and DELAY_DATA_OTHER."""


class Ultrasonic(I2CSensor, Measuring[float | None]):
    """The ultrasonic sensor; it measures continuously, except after a `snapshot`."""

    quantity, unit = "distance", "mm"

    _silent = True

    def set_up(self) -> None:
        """Set the port's type, then start continuous measurement, whatever mode another program has left."""
        super().set_up()
        self._measure_on()

    @property
    def distance_mm(self) -> float | None:
        """Distance to the nearest echo in steps of 10 mm, up to 2540; None without an echo."""
        if self._ready and self._silent:
            self._measure_on()
        return _mm(self.read(_DISTANCES, 1)[0])

    @property
    def value(self) -> float | None:
        """The same as `distance_mm`."""
        return self.distance_mm

    def snapshot(self) -> tuple[float, ...]:
        """Send a single ping; return the distances of up to eight echoes, nearest first, in millimetres.

        The sensor is silent afterwards, so that others can measure undisturbed, until its distance is read again.
        """
        self.write(_MODE, _SINGLE_SHOT)
        self._silent = True
        self.link.sleep(_PING_S)
        return tuple(sorted(mm for echo in self.read(_DISTANCES, _ECHOES) if (mm := _mm(echo)) is not None))

    def start(self) -> None:
        """Start a measurement without waiting for it; see `poll`."""
        if self._ready and self._silent:
            self._measure_on()
        self.ask(_DISTANCES)

    def poll(self) -> tuple[bool, float | None]:
        """Return whether the measurement begun by `start` is complete, and its distance as in `distance_mm`."""
        centimetres = self.answer()
        return (False, None) if centimetres is None else (True, _mm(centimetres))

    def _measure_on(self) -> None:
        self.write(_MODE, _CONTINUOUS)
        self._silent = False
        self.link.sleep(_FIRST_DISTANCE_S)


def _mm(centimetres: int) -> float | None:
    return None if centimetres == _NO_ECHO else centimetres * 10.0
