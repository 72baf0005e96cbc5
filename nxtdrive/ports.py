"""Ports as printed on the brick, and checks of arguments."""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Literal, TypeVar

from firmware_protocol.enums import InputPort, OutputPort
from firmware_protocol.errors import LocalProtocolError

T = TypeVar("T")
N = TypeVar("N", bound=float)

MotorPort = Literal["A", "B", "C"]
SensorPort = Literal[1, 2, 3, 4]
MOTOR_PORTS: tuple[MotorPort, ...] = ("A", "B", "C")
SENSOR_PORTS: tuple[SensorPort, ...] = (1, 2, 3, 4)

_OUTPUTS = {"A": OutputPort.A, "B": OutputPort.B, "C": OutputPort.C}
_INPUTS = {1: InputPort.IN_1, 2: InputPort.IN_2, 3: InputPort.IN_3, 4: InputPort.IN_4}


def output_port(name: str) -> OutputPort:
    """Convert the name of a motor port, in either case.

    Raises:
        LocalProtocolError: There is no such port.
    """
    port = _OUTPUTS.get(name.upper()) if isinstance(name, str) else None
    if port is None:
        raise LocalProtocolError(f"{name!r} is not a motor port.", remedy="Motors are plugged into 'A', 'B' or 'C'.")
    return port


def input_port(number: int) -> InputPort:
    """Convert the number of a sensor port.

    Raises:
        LocalProtocolError: There is no such port.
    """
    if not isinstance(number, int) or isinstance(number, bool) or number not in _INPUTS:
        raise LocalProtocolError(f"{number!r} is not a sensor port.", remedy="Sensors are plugged into 1, 2, 3 or 4.")
    return _INPUTS[number]


def in_range(name: str, value: N, minimum: float, maximum: float) -> N:
    """Return `value` if it is in range.

    Raises:
        LocalProtocolError: It is not a number from `minimum` to `maximum`; the message names it.
    """
    is_number = isinstance(value, Real) and not isinstance(value, bool)  # those of numpy's arrays, too
    if not is_number or not minimum <= value <= maximum:
        words = [] if is_number else ["a number"]
        words += [] if (minimum, maximum) == (-math.inf, math.inf) else [f"from {minimum:g} to {maximum:g}"]
        raise LocalProtocolError(f"{name} must be {' '.join(words) or 'a number'}, not {value!r}.")
    return value


def whole_number(name: str, value: int, minimum: int, maximum: int) -> int:
    """Return `value` as an int if it is in range.

    Raises:
        LocalProtocolError: It is not a whole number from `minimum` to `maximum`; the message names it.
    """
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)  # those of numpy's arrays, too
    if not is_whole or not minimum <= value <= maximum:
        raise LocalProtocolError(f"{name} must be a whole number from {minimum} to {maximum}, not {value!r}.")
    return int(value)


def of_type(name: str, value: T, kind: type[T]) -> T:
    """Return `value` if it is a `kind`.

    Raises:
        LocalProtocolError: It is not; the message names it.
    """
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        what = "a text" if kind is str else f"{article} {kind.__name__}"
        raise LocalProtocolError(f"{name} must be {what}, not {value!r}.")
    return value
