"""Sensors on the input ports.

A sensor sets up its port on first use, and again when the port was reset: a program was started or ended, or the brick
was switched off.
`docs/sensors.md` lists units, ranges and their sources.
"""

from nxtdrive.sensors.analog import Light, RcxTemperature, Sound, Touch
from nxtdrive.sensors.color import Color, ColorSensor
from nxtdrive.sensors.digital import Compass, Temperature
from nxtdrive.sensors.i2c import I2CSensor
from nxtdrive.sensors.identity import Identity, identify
from nxtdrive.sensors.port import Sensor
from nxtdrive.sensors.reading import QuantitySensor, Reading
from nxtdrive.sensors.ultrasonic import Ultrasonic

__all__ = [
    "Color",
    "ColorSensor",
    "Compass",
    "I2CSensor",
    "Identity",
    "Light",
    "QuantitySensor",
    "RcxTemperature",
    "Reading",
    "Sensor",
    "Sound",
    "Temperature",
    "Touch",
    "Ultrasonic",
    "identify",
]
