"""Check a rover's ports: each sensor is of the right kind, and no port is used twice."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TypeVar

from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LocalProtocolError
from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort, of_type
from nxtdrive.sensors import Sensor

S = TypeVar("S", bound=Sensor)


def sensor_at(link: Link, kind: type[S], at: SensorPort | S | None) -> S | None:
    """Return the sensor at a port; a sensor is returned as it is.

    Raises:
        LocalProtocolError: It is a sensor of another kind, or there is no such port.
    """
    if isinstance(at, Sensor):
        return of_type(kind.__name__.lower(), at, kind)
    return None if at is None else kind(link, at)


def check_ports(wheels: tuple[OutputPort, OutputPort], sensors: Mapping[str, Sensor | None]) -> None:
    """Check that no port is used twice.

    Raises:
        LocalProtocolError: One is; the message says by what.
    """
    if wheels[0] == wheels[1]:
        raise LocalProtocolError(
            f"left and right both use port {wheels[0].name}.", remedy="Each motor has a port of its own."
        )
    for (one, sensor), (other, its_sensor) in combinations(sensors.items(), 2):
        if sensor and its_sensor and sensor.port == its_sensor.port:
            raise LocalProtocolError(
                f"{one} and {other} both use port {sensor.port}.", remedy="Each sensor has its own port."
            )
