"""An input port, configured for the sensor plugged into it."""

from __future__ import annotations

from firmware_protocol.direct import GetInputValues, InputValues, SetInputMode
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.errors import LinkTimeout
from nxtdrive.link.protocol import SensorLink
from nxtdrive.ports import SensorPort, input_port

SETTLING_S = 0.5
"""Longest a sensor's values stay invalid after its type was set: 400 ms. Source: docs/firmware.md section 6."""
STEP_S = 0.005
"""Shortest polling period for a value that is not ready yet; on a slow link the round trip takes longer."""


class SensorTimeout(LinkTimeout):
    """The brick answers, but the sensor does not."""


class Sensor:
    """An input port set to one type of sensor when it is first used.

    Attributes:
        link: The link to the brick.
        port: 1..4, as printed on the brick.
        type: The port's sensor type in the firmware.
        mode: The firmware's scaling of the values.
    """

    type = SensorType.NONE
    mode = SensorMode.RAW

    def __init__(self, link: SensorLink, port: SensorPort) -> None:
        self.link = link
        self.port = port
        self._input = input_port(port)
        self._ready = False

    @property
    def ready(self) -> bool:
        """Whether the port was set up and, as far as known, has not been reset since."""
        return self._ready

    def set_up(self) -> None:
        """Set the port's type and wait until its values are valid.

        Raises:
            SensorTimeout: They do not become valid.
        """
        link = self.link
        mode = SetInputMode(self._input, self.type, self.mode)
        link.request(mode)
        link.restore_mode(mode)
        asked = link.now()
        deadline = asked + SETTLING_S
        while not link.request(GetInputValues(self._input)).valid:
            if asked >= deadline:
                raise SensorTimeout(
                    f"the sensor on port {self.port} gives no valid values.", remedy="Is it plugged in?"
                )
            link.sleep(asked + STEP_S - link.now())
            asked = link.now()
        self._ready = True

    def values(self) -> InputValues:
        """Return all values that the firmware has for the port."""
        if not self._ready:
            self.set_up()
        values = self.link.request(GetInputValues(self._input))
        if values.type is not self.type:  # a program was started or stopped: that resets all ports
            self.set_up()
            values = self.link.request(GetInputValues(self._input))
        return values

    def _become(self, type: SensorType) -> None:
        """Change the port's type; it is set up again at its next use."""
        if type is not self.type:
            self.type, self._ready = type, False
