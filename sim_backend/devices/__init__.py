"""Sensors for the simulated brick: callables supply the measured quantity, the output is that of LEGO's sensors.

Connect them to a `SimBrick` with `attach_sensor`; `sim_backend.devices.mounting` makes those of a world file.
"""

from sim_backend.devices.analog import AnalogInput, LightSensor, RcxTemperatureSensor, SoundSensor, TouchSensor
from sim_backend.devices.color import ColorSensor
from sim_backend.devices.digital import NO_ECHO, Compass, GenericI2CDevice, TemperatureSensor, UltrasonicSensor

__all__ = [
    "NO_ECHO",
    "AnalogInput",
    "ColorSensor",
    "Compass",
    "GenericI2CDevice",
    "LightSensor",
    "RcxTemperatureSensor",
    "SoundSensor",
    "TemperatureSensor",
    "TouchSensor",
    "UltrasonicSensor",
]
