"""Sensors to plug into the simulated brick: what they perceive comes from functions, what they say is LEGO's.

Plug them into a `SimBrick` with `attach_sensor`; those of a world file are made by `sim_backend.devices.mounting`.
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
