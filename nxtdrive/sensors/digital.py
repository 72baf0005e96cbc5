"""Further sensors on the I2C bus."""

from __future__ import annotations

from firmware_protocol.errors import BrickError, SensorTimeout
from nxtdrive.sensors.i2c import I2CSensor
from nxtdrive.sensors.reading import QuantitySensor


class Compass(I2CSensor, QuantitySensor[int]):
    """HiTechnic's compass (NMC1034). Source of registers: HiTechnic's data sheet.

    Mount it at least 10 cm from motors and brick, whose fields are stronger than the earth's.
    """

    quantity, unit = "heading", "°"
    _HEADING = 0x42

    @property
    def heading_deg(self) -> int:
        """Direction, 0..359 clockwise from magnetic north.

        Raises:
            SensorTimeout: The sensor gives other values, so it is not a compass.
        """
        halves, odd = self.read(self._HEADING, 2)
        if (heading_deg := 2 * halves + odd) >= 360:
            raise SensorTimeout(
                f"the sensor on port {self.port} gives a heading of {heading_deg} degrees; a compass gives 0 to 359.",
                remedy="Is it a compass? `nxtdrive sensor identify` says what is plugged in.",
            )
        return heading_deg

    value = heading_deg


class Temperature(I2CSensor, QuantitySensor[float]):
    """LEGO's temperature sensor for the NXT (9749), a TMP275. Source of registers: Texas Instruments' data sheet."""

    address = 0x98
    quantity, unit = "temperature", "°C"
    _TEMPERATURE, _CONFIGURATION = 0x00, 0x01
    _TWELVE_BITS = 0x60
    _CONVERSION_S = 0.3

    def set_up(self) -> None:
        """Set the port's type, and the sensor to its finest resolution, where measuring takes 0.22 s, 0.3 s at most."""
        super().set_up()
        self.write(self._CONFIGURATION, self._TWELVE_BITS)
        self.link.sleep(self._CONVERSION_S)

    @property
    def celsius(self) -> float:
        """Temperature in steps of 0.0625 °C, -55..127."""
        return int.from_bytes(self.read(self._TEMPERATURE, 2), "big", signed=True) / 256

    value = celsius

    def _transact(self, data: bytes, size: int) -> bytes:
        try:
            return super()._transact(data, size)
        except (BrickError, SensorTimeout):
            self._ready = False  # a sensor that was unplugged has lost its resolution
            raise
