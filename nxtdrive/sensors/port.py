"""An input port, set to what is plugged in."""

from __future__ import annotations

from firmware_protocol.direct import GetInputValues, InputValues, SetInputMode
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.errors import LinkTimeout
from nxtdrive.link.protocol import SensorLink
from nxtdrive.ports import SensorPort, input_port

SETTLING_S = 0.5
"""Longest a sensor's values stay invalid after its type was set: 400 ms. Source: docs/firmware.md section 6."""
STEP_S = 0.005
"""Shortest time between two looks at a value that is not there yet; a slow link takes longer by itself."""


class SensorTimeout(LinkTimeout):
    """The brick answers, but the sensor does not."""


class Sensor:
    """An input port set to one type of sensor when it is first used.

    Attributes:
        link: The way to the brick.
        port: 1..4, as printed on the brick.
        type: What the firmware is told to find there.
        mode: How the firmware is told to scale it.
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
        """Whether the port was set up, and is still so for all we know."""
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
        """All the firmware knows of the port."""
        if not self._ready:
            self.set_up()
        values = self.link.request(GetInputValues(self._input))
        if values.type is not self.type:  # a program was started or stopped: that resets all ports
            self.set_up()
            values = self.link.request(GetInputValues(self._input))
        return values

    def _become(self, type: SensorType) -> None:
        """Have the port set up as another type before it is used again."""
        if type is not self.type:
            self.type, self._ready = type, False
