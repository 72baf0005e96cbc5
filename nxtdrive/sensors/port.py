"""An input port, set to what is plugged in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.direct import GetInputValues, InputValues, SetInputMode
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.errors import LinkTimeout
from nxtdrive.ports import SensorPort, input_port

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

SETTLING_S = 0.5
"""Longest a sensor's values stay invalid after its type was set: 400 ms. Source: docs/firmware.md section 6."""
STEP_S = 0.005
"""Shortest time between two looks at a value that is not there yet; a slow link takes longer by itself."""


class Sensor:
    """An input port set to one type of sensor when it is first used.

    Attributes:
        brick: Where it is plugged in.
        port: 1..4, as printed on the brick.
        type: What the firmware is told to find there.
        mode: How the firmware is told to scale it.
    """

    type = SensorType.NONE
    mode = SensorMode.RAW

    def __init__(self, brick: Brick, port: SensorPort) -> None:
        self.brick = brick
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
            LinkTimeout: They do not become valid.
        """
        brick = self.brick
        mode = SetInputMode(self._input, self.type, self.mode)
        brick.request(mode)
        brick.remember(mode)
        asked = brick.now()
        deadline = asked + SETTLING_S
        while not brick.request(GetInputValues(self._input)).valid:
            if asked >= deadline:
                raise LinkTimeout(f"the sensor on port {self.port} gives no valid values.", remedy="Is it plugged in?")
            brick.sleep(asked + STEP_S - brick.now())
            asked = brick.now()
        self._ready = True

    def values(self) -> InputValues:
        """All the firmware knows of the port."""
        if not self._ready:
            self.set_up()
        values = self.brick.request(GetInputValues(self._input))
        if values.type is not self.type:  # a program was started or stopped: that resets all ports
            self.set_up()
            values = self.brick.request(GetInputValues(self._input))
        return values

    def _become(self, type: SensorType) -> None:
        """Have the port set up as another type before it is used again."""
        if type is not self.type:
            self.type, self._ready = type, False
