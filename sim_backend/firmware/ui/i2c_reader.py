"""The I2C sensors whose values the menus show or log, read again and again. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from typing import NamedTuple

from sim_backend.firmware.sensors.low_speed import LowSpeedModule
from sim_backend.firmware.sensors.low_speed_channel import ChannelError

_PERIOD_MS, _OLD_PERIOD_MS = 100, 50
_ASKED_MS, _OLD_ASKED_MS = 30, 25
_TAKEN_MS, _OLD_TAKEN_MS = 80, 0
"""The period, and when in it a sensor is asked and its bytes are taken: in old firmware, those of the previous one."""

_STEP_MS, _OLD_STEP_MS = 10, 25
"""A divisor of these times."""


class I2CSensor(NamedTuple):
    """A sensor that the menus know.

    Attributes:
        set_up: Message that sets it up, the address first.
        request: Message that asks for its value.
        size: Number of bytes of the value.
        repeats: Whether it is set up in each period.
        keeps: Whether its value stays when it does not answer, unless a line is held low or the input has another type.
    """

    set_up: bytes
    request: bytes
    size: int
    repeats: bool
    keeps: bool


DISTANCE = I2CSensor(b"\x02\x41\x02", b"\x02\x42", 1, repeats=False, keeps=False)
TEMPERATURE = I2CSensor(b"\x98\x01\x60", b"\x98\x00", 2, repeats=True, keeps=True)


class I2CReader:
    """Reads the sensors of a page, whatever else happens on their ports.

    Args:
        low_speed: The I2C ports.
        modern: Whether the firmware has the newer times.

    Attributes:
        step_ms: Period in which there may be something to do.
    """

    def __init__(self, low_speed: LowSpeedModule, *, modern: bool) -> None:
        self._low_speed = low_speed
        self._period_ms, self._asked_ms, self._taken_ms, self.step_ms = (
            (_PERIOD_MS, _ASKED_MS, _TAKEN_MS, _STEP_MS)
            if modern
            else (_OLD_PERIOD_MS, _OLD_ASKED_MS, _OLD_TAKEN_MS, _OLD_STEP_MS)
        )
        self._sensors: dict[int, I2CSensor] = {}
        self._data: dict[int, bytes | None] = {}

    def begin(self, sensors: dict[int, I2CSensor]) -> None:
        """Set up the sensors of these ports, 0..3."""
        self._sensors, self._data = sensors, {}
        for port, sensor in sensors.items():
            self._low_speed.send(port, sensor.set_up, 0)

    def go_on(self, passed_ms: int) -> None:
        """Take the next step of each sensor, at a time after the page began that is a multiple of `step_ms`."""
        at_ms = passed_ms % self._period_ms
        for port, sensor in self._sensors.items():
            if at_ms == self._taken_ms:
                self._take(port, sensor)
            if at_ms == self._asked_ms:
                self._low_speed.send(port, sensor.request, sensor.size)
            elif at_ms == 0 and sensor.repeats:
                self._low_speed.send(port, sensor.set_up, 0)

    def _take(self, port: int, sensor: I2CSensor) -> None:
        """Take the bytes of a sensor, or note that there are none."""
        data = self._low_speed.take(port, sensor.size)
        ready = self._low_speed.channels[port].error != ChannelError.NOT_READY
        if data is not None or not (sensor.keeps and ready):
            self._data[port] = data

    def data(self, port: int) -> bytes | None:
        """Return the bytes that were taken last, or None if the sensor did not answer."""
        return self._data.get(port)
