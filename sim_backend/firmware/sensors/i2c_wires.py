"""The two wires of an input port's I2C bus, with the firmware's pins at one end and a sensor at the other.

Source: docs/firmware.md section 7.
"""

from __future__ import annotations

from sim_backend.firmware.sensors.i2c_sensor import I2CDevice, SensorEnd


class Wires:
    """The clock and data line of a port, which are pins 0 and 1 of the input; each is low if one of its ends is.

    The firmware's pins keep their level while they are inputs, and a line without an output is high.

    Attributes:
        sensor: The sensor's end.
    """

    def __init__(self) -> None:
        self.sensor = SensorEnd()
        self._clock_level = self._data_level = True
        self._drives_clock = self._drives_data = self._is_data_input = False
        self._clock_held = self._data_held = False
        self._seen_clock = self._seen_data = True

    @property
    def clock_high(self) -> bool:
        """Whether the firmware releases the clock line."""
        return self._clock_level or not self._drives_clock

    @property
    def clock(self) -> bool:
        """Whether the clock line is high."""
        return self.clock_high and not self._clock_held

    @property
    def data(self) -> bool:
        """Whether the data line is high."""
        return (self._data_level or not self._drives_data) and not self._data_held and not self.sensor.pulls_data

    @property
    def stuck(self) -> bool:
        """Whether a line is low."""
        return not (self.clock and self.data)

    def set_clock(self, high: bool) -> None:
        """Set the clock pin; nothing happens on the line while the pin is an input.

        In a pulse the sensor sees the level of the data pin even if that is an input, unless `set_pin` made it one.
        """
        self._clock_level = high
        clock = (high or not self._drives_clock) and not self._clock_held
        if clock != self._seen_clock:
            self._seen_clock = clock
            if clock:
                self.sensor.rise(self.data and (self._data_level or self._is_data_input))
            else:
                self.sensor.fall()
            self._seen_data = self.data

    def set_data(self, high: bool) -> None:
        """Set the data pin; nothing happens on the line while the pin is an input."""
        self._data_level = high
        data = (high or not self._drives_data) and not self._data_held and not self.sensor.pulls_data
        if data != self._seen_data:
            self._see(data)

    def pull_data(self) -> None:
        """Make the data pin a low output."""
        self._drives_data, self._is_data_input = True, False
        self.set_data(False)

    def free_data(self) -> None:
        """Make the data pin an input."""
        self._drives_data = self._is_data_input = False
        self._follow_data()

    def set_pin(self, pin: int, level: bool | None) -> None:
        """Make pin 0 (clock) or 1 (data) an output of that level, or an input."""
        if pin == 0:
            self._drives_clock = level is not None
            self.set_clock(self._clock_level if level is None else level)
        else:
            self._drives_data, self._is_data_input = level is not None, level is None
            self.set_data(self._data_level if level is None else level)

    def level(self, pin: int) -> bool:
        """Return whether the line of pin 0 (clock) or 1 (data) is high."""
        return self.data if pin else self.clock

    def release(self) -> None:
        """Make both pins inputs, the data pin first; their levels are high."""
        for pin in (1, 0):
            self.set_pin(pin, True)
            self.set_pin(pin, None)

    def _follow_data(self) -> None:
        if (data := self.data) != self._seen_data:
            self._see(data)

    def _see(self, data: bool) -> None:
        """Pass a change of the data line to the sensor."""
        self._seen_data = data
        if self._seen_clock:
            self.sensor.stop() if data else self.sensor.start()
            self._seen_data = self.data

    def hold(self, *, clock: bool | None = None, data: bool | None = None) -> None:
        """Hold lines low from outside, or release them; the sensor does not count that as a pulse."""
        self._clock_held = self._clock_held if clock is None else clock
        self._data_held = self._data_held if data is None else data
        self._seen_clock, self._seen_data = self.clock, self.data

    def connect(self, device: I2CDevice | None) -> None:
        """Plug in a device, or none."""
        self.sensor.connect(device)
        self._follow_data()
