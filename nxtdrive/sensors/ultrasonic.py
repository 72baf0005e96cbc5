"""LEGO's ultrasonic sensor (9846).

Source of register numbers and "no echo": LEGO's Hardware Developer Kit, ultrasonic sensor I2C map.
"""

from __future__ import annotations

import math

from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort
from nxtdrive.sensors.i2c import I2CSensor
from nxtdrive.sensors.reading import QuantitySensor, Reading

_MODE, _DISTANCES = 0x41, 0x42
_SINGLE_SHOT, _CONTINUOUS = 0x01, 0x02
_ECHOES = 8
_NO_ECHO = 0xFF
_PING_S, _FIRST_DISTANCE_S = 0.05, 0.03
"""Time until distances are ready after a single shot, and after continuous measuring began.
Source: leJOS NXJ, class UltrasonicSensor, DELAY_DATA_PING and DELAY_DATA_OTHER."""


class Ultrasonic(I2CSensor, QuantitySensor[float | None]):
    """The ultrasonic sensor; it measures continuously except after a `snapshot`.

    A program and the safety stop of a `Rover` may read one object at the same time: a reading of either serves both.
    """

    quantity, unit = "distance", "mm"

    def __init__(self, link: Link, port: SensorPort) -> None:
        super().__init__(link, port)
        self._silent = True
        self._lock = link.new_lock()
        self._last: Reading[float | None] | None = None
        self._started = False
        self._started_s = math.inf

    def set_up(self) -> None:
        """Set the port's type and start continuous measuring."""
        super().set_up()
        self._measure_on()

    @property
    def distance_mm(self) -> float | None:
        """Distance to the nearest echo in steps of 10 mm, up to 2540; None without an echo."""
        with self._lock:
            if self._ready and self._silent:
                self._measure_on()
            begun_s = self.link.now()
            distance_mm = _mm(self._transact(bytes((self.address, _DISTANCES)), 1)[0])
            self._last, self._started = Reading(distance_mm, begun_s), False
        return distance_mm

    value = distance_mm

    def snapshot(self) -> tuple[float, ...]:
        """Measure up to eight echoes of a single ping; returns their distances in millimetres, nearest first.

        The sensor is silent afterwards until the next measurement, so that others can measure undisturbed.
        """
        with self._lock:
            self._transact(bytes((self.address, _MODE, _SINGLE_SHOT)), 0)
            self._silent, self._started = True, False
            self.link.sleep(_PING_S)
            echoes = self._transact(bytes((self.address, _DISTANCES)), _ECHOES)
        return tuple(sorted(mm for echo in echoes if (mm := _mm(echo)) is not None))

    def read(self, register: int, size: int) -> bytes:
        """Read as `I2CSensor.read` does, after waiting for a reading in progress."""
        with self._lock:
            self._started = False
            return super().read(register, size)

    def write(self, register: int, *values: int) -> None:
        """Write as `I2CSensor.write` does, after waiting for a reading in progress."""
        with self._lock:
            self._started = False
            super().write(register, *values)

    def start(self) -> None:
        """Start a measurement without waiting for it; see `poll`. While another caller reads, that reading will do."""
        self._started_s = self.link.now()
        if self._lock.acquire(blocking=False):
            try:
                if self._ready and self._silent:
                    self._measure_on()
                self.start_read(_DISTANCES)
                self._started = True
            finally:
                self._lock.release()

    def poll(self) -> tuple[bool, float | None]:
        """Fetch the measurement of `start`, or one that another caller has made since.

        Returns:
            Whether there is one, and the distance as in `distance_mm`.
        """
        if self._last is not None and self._last.time_s >= self._started_s:
            return True, self._last.value
        if not self._lock.acquire(blocking=False):
            return False, None
        try:
            if not self._started:
                self.start_read(_DISTANCES)
                self._started = True
                return False, None
            centimetres = self.fetch()
        finally:
            self._lock.release()
        return (False, None) if centimetres is None else (True, _mm(centimetres))

    def _measure_on(self) -> None:
        self._transact(bytes((self.address, _MODE, _CONTINUOUS)), 0)
        self._silent = False
        self.link.sleep(_FIRST_DISTANCE_S)


def _mm(centimetres: int) -> float | None:
    return None if centimetres == _NO_ECHO else centimetres * 10.0
