"""An input port, set up for its sensor."""

from __future__ import annotations

from firmware_protocol.direct import GetInputValues, InputValues, SetInputMode
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.errors import SensorTimeout
from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort, input_port

SETTLING_S = 0.5
"""Timeout for valid values after the type was set, which takes up to 400 ms. Source: docs/firmware.md section 6."""
STEP_S = 0.005
"""Shortest interval for polling a value that is not ready yet."""


class Sensor:
    """An input port that is set up for one type of sensor at the first use.

    Attributes:
        link: The link to the brick.
        port: 1..4, as printed on the brick.
        type: The sensor type to set.
        mode: How the firmware scales the values.
    """

    type = SensorType.NONE
    mode = SensorMode.RAW

    def __init__(self, link: Link, port: SensorPort) -> None:
        self.link = link
        self.port = port
        self._input = input_port(port)
        self._ready = False

    @property
    def ready(self) -> bool:
        """Whether the driver has set the port up, and has not seen it reset since."""
        return self._ready

    def set_up(self) -> None:
        """Set the port's type and wait for valid values.

        Raises:
            SensorTimeout: The values do not become valid.
        """
        link = self.link
        link.request(SetInputMode(self._input, self.type, self.mode))
        sent_s = link.now()
        deadline = sent_s + SETTLING_S
        while not link.request(GetInputValues(self._input)).valid:
            if sent_s >= deadline:
                raise SensorTimeout(
                    f"the sensor on port {self.port} gives no valid values.", remedy="Is it plugged in?"
                )
            link.sleep(sent_s + STEP_S - link.now())
            sent_s = link.now()
        self._ready = True

    def values(self) -> InputValues:
        """Read all values of the port."""
        if not self._ready:
            self.set_up()
        values = self.link.request(GetInputValues(self._input))
        if values.type is not self.type:  # a program has reset the port, or the brick was switched off
            self.set_up()
            values = self.link.request(GetInputValues(self._input))
        return values

    def _become(self, type: SensorType) -> None:
        """Change the type; the port is set up again at the next use."""
        if type is not self.type:
            self.type, self._ready = type, False
