"""Make the sensors of a world file, connected to its world."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from sim_backend.devices.analog import (
    LightSensor,
    RcxTemperatureSensor,
    SoundSensor,
    TouchSensor,
    reflected_percent,
    shaded_percent,
)
from sim_backend.devices.color import ColorSensor
from sim_backend.devices.digital import Compass, GenericI2CDevice, TemperatureSensor, UltrasonicSensor
from sim_backend.firmware.sensors.i2c_sensor import I2CDevice
from sim_backend.firmware.sensors.input_port import AnalogSensor
from sim_backend.world.sensor_tables import (
    ColorMount,
    CompassMount,
    I2CMount,
    LightMount,
    Mount,
    SoundMount,
    TemperatureMount,
    TouchMount,
    UltrasonicMount,
)
from sim_backend.world.world import World

RED = 0
"""Index of the colour of the light sensor's lamp."""


def mount(table: Mount, world: World, lamp: Callable[[], bool]) -> AnalogSensor | I2CDevice:
    """Make the device that a table of a world file describes.

    Args:
        table: One of the file's sensors.
        world: The world it measures.
        lamp: Returns whether the brick has switched on the lamp of a light sensor on this port.
    """
    noise = _Noise(world, table.port)
    match table:
        case TouchMount(direction_deg=direction_deg, width_deg=width_deg):
            return TouchSensor(lambda: world.robot.touched(direction_deg, width_deg))
        case LightMount():
            return _light_sensor(table, world, lamp, noise)
        case ColorMount():
            return _color_sensor(table, world, noise)
        case SoundMount(noise_db=noise_db):
            here = (0.0, 0.0)
            return SoundSensor(
                lambda: world.surroundings.sound_db(world.robot.point_mm(here), world.now_ms) + noise.draw(noise_db)
            )
        case UltrasonicMount(at_mm=at_mm, direction_deg=direction_deg):
            return UltrasonicSensor(world.beam(table, at_mm, direction_deg, f"port {table.port}").distance_cm)
        case TemperatureMount(model=model):
            kind = TemperatureSensor if model == "nxt" else RcxTemperatureSensor
            return kind(lambda: world.surroundings.temperature_c)
        case CompassMount():
            return _compass(table, world, noise)
        case I2CMount():
            return _i2c_device(table)


class _Noise:
    """Random errors that are constant within a step of the world, independent of the number of readings."""

    def __init__(self, world: World, port: int) -> None:
        self._world, self._port = world, port

    def draw(self, deviation: float, number: int = 0) -> float:
        """Return the error of this step; `number` distinguishes values measured at the same time."""
        if not deviation:
            return 0.0
        key = f"{self._world.seed}/port {self._port}/{self._world.now_ms}/{number}"
        return Random(key).gauss(0.0, deviation)


def _light_sensor(table: LightMount, world: World, lamp: Callable[[], bool], noise: _Noise) -> LightSensor:
    surroundings = world.surroundings

    def brightness_percent() -> float:
        light = surroundings.ambient_percent
        if table.looks == "down":
            red = surroundings.paint(world.robot.point_mm(table.at_mm))[RED]
            light = reflected_percent(red, light, lamp=lamp())
        return light + noise.draw(table.noise_percent)

    return LightSensor(brightness_percent)


def _color_sensor(table: ColorMount, world: World, noise: _Noise) -> ColorSensor:
    surroundings = world.surroundings

    def reflected() -> tuple[float, float, float]:
        red, green, blue = surroundings.paint(world.robot.point_mm(table.at_mm))
        errors = (noise.draw(table.noise_percent, lamp) for lamp in range(3))
        return red + next(errors), green + next(errors), blue + next(errors)

    def ambient() -> float:
        brightness = sum(surroundings.paint(world.robot.point_mm(table.at_mm))) / 3
        return shaded_percent(brightness, surroundings.ambient_percent)

    return ColorSensor(reflected, ambient)


def _compass(table: CompassMount, world: World, noise: _Noise) -> Compass:
    robot = world.robot

    def heading_deg() -> float:
        north_deg = world.surroundings.north_deg(robot.point_mm((0.0, 0.0)))
        return robot.heading_deg - north_deg + noise.draw(table.noise_deg)

    return Compass(heading_deg)


def _i2c_device(table: I2CMount) -> GenericI2CDevice:
    device = GenericI2CDevice(table.address)
    for name, value in table.registers.items():
        data = value.encode("latin-1") if isinstance(value, str) else bytes(value)
        first = int(name, 0)
        device.registers[first : first + len(data)] = data
    return device
