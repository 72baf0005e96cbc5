"""LEGO's colour sensor for the NXT (9694)."""

from __future__ import annotations

from typing import Literal

from firmware_protocol.enums import OpenEnum, SensorType
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.iomap import INPUT
from firmware_protocol.system import GetVersions
from nxtdrive.sensors.analog import FULL_SCALE
from nxtdrive.sensors.port import Sensor
from nxtdrive.sensors.reading import Measuring

Lamp = "red") -> float:
        """Brightness with one lamp lit, or none, 0..100."""
        self._become(_LAMPS[lamp])
        return self.values().normalized * 100 / FULL_SCALE

    def set_up(self) -> None:
        """Set the port's type and wait until the sensor has handed over its calibration.

        Raises:
            LinkTimeout: It does not.
            LocalProtocolError: The brick's firmware is too old for it.
        """
        firmware = self.brick.request(GetVersions()).firmware
        if tuple(map(int, firmware.split("."))) <= LAST_BLIND_FIRMWARE:
            raise LocalProtocolError(
                f"firmware {firmware} cannot read colour sensors.", remedy="Put LEGO's firmware 1.29 on the brick."
            )
        super().set_up()
