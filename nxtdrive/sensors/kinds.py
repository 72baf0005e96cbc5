"""Sensors by name, for the command line, the monitor and teleoperation."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from firmware_protocol.errors import ConfigError
from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort
from nxtdrive.sensors.analog import Light, RcxTemperature, Sound, Touch
from nxtdrive.sensors.color import Color, ColorSensor
from nxtdrive.sensors.digital import Compass, Temperature
from nxtdrive.sensors.reading import QuantitySensor
from nxtdrive.sensors.ultrasonic import Ultrasonic

KINDS: dict[str, Callable[[Link, SensorPort], QuantitySensor[Any]]] = {
    "touch": Touch,
    "light": Light,
    "ambient": partial(Light, lamp=False),
    "sound": Sound,
    "sound-dba": partial(Sound, dba=True),
    "ultrasonic": Ultrasonic,
    "color": ColorSensor,
    "temperature": Temperature,
    "rcx-temperature": RcxTemperature,
    "compass": Compass,
}
"""Name to constructor; to add a sensor, add its class and a line here."""


def make_sensor(kind: str, link: Link, port: SensorPort) -> QuantitySensor[Any]:
    """Make a sensor by the name of its kind.

    Raises:
        ConfigError: There is no such kind.
    """
    if kind not in KINDS:
        raise ConfigError(f"there is no sensor {kind!r}.", remedy=f"There are: {', '.join(KINDS)}.")
    return KINDS[kind](link, port)


def kind_of(sensor: QuantitySensor[Any]) -> str:
    """Return the name of a sensor's kind, regardless of its settings; an empty string if it is not listed."""
    return next((kind for kind, make in KINDS.items() if make is type(sensor)), "")


def in_words(value: object, unit: str = "") -> str:
    """Format a measured value for display: ``310 mm``, ``yes``, ``red``, ``no echo`` for None."""
    if value is None:
        return "no echo"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Color):
        return value.label
    number = f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else str(value)
    return f"{number}{'' if unit in ('°', '') else ' '}{unit}"


def plain(value: object) -> object:
    """Convert a measured value for JSON: colours become names, other values stay."""
    return value.label if isinstance(value, Color) else value
