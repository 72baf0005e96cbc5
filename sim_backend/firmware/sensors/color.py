"""The colour sensor's part of an input port: calibration of its readings, and the name of the colour.

Source: docs/firmware.md section 6.1. The wire protocol that transfers the sensor's calibration is not simulated.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import Protocol, runtime_checkable

from firmware_protocol.enums import SensorMode
from sim_backend.firmware.sensors.analog import LEVEL, MODE_BITS, SLOPE_BITS, boolean, full_scale

RED, GREEN, BLUE, BLANK = range(4)
"""The lit lamp of the sensor; blank is none."""

CALIBRATING, OFF = 1, 2
"""Calibration states: the calibration is being read; no sensor answers."""

_LEVELS = (True, False, True, False)
"""Levels of the first pin in the first steps of reading a calibration; the last one stays."""

_REST = 100
"""Passes without steps after these."""

_FIRST_BYTE = len(_LEVELS) + 4
"""Step that reads the first byte; each further one reads the next, and one more begins again."""

_CALIBRATION = struct.Struct("<12I2H")
"""Factors and limits of a calibration."""

_NO_ANSWER = 0xFF
"""Byte that is read if no sensor answers."""

_BACKGROUND_ZERO, _BACKGROUND_PERCENT = 71, 93
_FACTOR_BITS = 16


class Color(IntEnum):
    """Colour numbers of the firmware."""

    BLACK = 1
    BLUE = 2
    GREEN = 3
    YELLOW = 4
    RED = 5
    WHITE = 6


@runtime_checkable
class ColorDevice(Protocol):
    """A colour sensor as the firmware sees it.

    Attributes:
        calibration: Three rows of factors for red, green, blue and blank, in 1/65536, for bright, dim and dark
            surroundings.
        limits: Blank readings below which the second and the third row apply.
    """

    calibration: Sequence[Sequence[int]]
    limits: Sequence[int]

    def lit(self, lamp: int) -> int:
        """Return the converter's value, 0..1023, while `lamp` is on."""


class ColorPort:
    """Values of a colour sensor in the Input map; rows of four are red, green, blue and blank.

    Attributes:
        device: The sensor, or None.
        state: Calibration state of the map: see `CALIBRATING`, `OFF`; 0 when the calibration was read.
        calibration: All factors of the sensor, row after row.
        limits: Limits of the sensor.
        readings: Converter values.
        normalized: Readings after background subtraction and calibration.
        scaled: Values in the port's mode; other counting modes than that of transitions leave them as they are.
        booleans: Values by the port's slope.
    """

    def __init__(self) -> None:
        self.device: ColorDevice | None = None
        self.state = self._step = self._rest = 0
        self.calibration: tuple[int, ...] = (0,) * 12
        self.limits: tuple[int, ...] = (0, 0)
        nothing: tuple[int, ...] = (0, 0, 0, 0)
        self.readings = self.normalized = self.scaled = self.booleans = nothing

    def plug_in(self, device: ColorDevice | None) -> None:
        """Connect a sensor and copy its calibration."""
        self.device = device
        if device is not None:
            self.calibration = tuple(factor for row in device.calibration for factor in row)
            self.limits = tuple(device.limits)

    def begin_calibration(self, delay: int = 0) -> None:
        """Begin to read the calibration, so many passes later."""
        self.state = CALIBRATING
        self.begin_reading()
        self._rest = delay

    def begin_reading(self) -> None:
        """Begin with the first step, in any state."""
        self._step = self._rest = 0

    def begin_pass(self) -> None:
        """Count a pass, which may do steps of reading the calibration."""
        self._rest = max(self._rest - 1, 0)

    def step(self) -> tuple[bool | None, bool]:
        """Do a step of reading the calibration of a sensor that does not answer.

        Returns:
            The level that the first pin gets, or None; and whether the reading fails, which then begins again.
        """
        if self._rest:
            return None, False
        self._step += 1
        if self._step == len(_LEVELS):
            self._rest = _REST
        if self._step <= len(_LEVELS):
            return _LEVELS[self._step - 1], False
        return None, self._step >= _FIRST_BYTE and self._read_byte(self._step - _FIRST_BYTE)

    def _read_byte(self, place: int) -> bool:
        """Read a byte of the calibration; return whether it is the last one."""
        if place == _CALIBRATION.size:
            self.begin_reading()
            return False
        read = bytearray(_CALIBRATION.pack(*self.calibration, *self.limits))
        read[place] = _NO_ANSWER
        values = _CALIBRATION.unpack(read)
        self.calibration, self.limits = values[: len(self.calibration)], values[len(self.calibration) :]
        return place == _CALIBRATION.size - 1

    def read_nothing(self, mode: int) -> Color:
        """Take the values of a sensor that does not answer; they name black."""
        self._scale((0, 0, 0, 0), mode)
        return Color.BLACK

    def measure(self, device: ColorDevice, mode: int) -> Color:
        """Light the lamps in turn and name the colour."""
        self.readings = red, green, blue, blank = tuple(device.lit(lamp) for lamp in (RED, GREEN, BLUE, BLANK))
        row = device.calibration[sum(blank < limit for limit in device.limits)]
        lit = (max(0, reading - blank) for reading in (red, green, blue))
        values = zip((*lit, background(blank)), row, strict=True)
        self._scale(tuple(value * factor >> _FACTOR_BITS for value, factor in values), mode)
        return name_color(*self.normalized)

    def _scale(self, normalized: tuple[int, ...], mode: int) -> None:
        before, self.normalized = self.normalized, normalized
        were, slope = self.booleans, mode & SLOPE_BITS
        self.booleans = tuple(boolean(new, slope, old) for new, old in zip(normalized, before, strict=True))
        mode &= MODE_BITS
        if level := LEVEL.get(mode):
            self.scaled = tuple(map(level, normalized))
        elif mode == SensorMode.BOOLEAN:
            self.scaled = self.booleans
        elif mode == SensorMode.TRANSITION_COUNT:
            changes = zip(self.scaled, were, self.booleans, strict=True)
            self.scaled = tuple(count + (now != was) for count, was, now in changes)


def background(reading: int) -> int:
    """Normalize a blank or single-lamp reading; not inverted, unlike the light sensor's."""
    return full_scale(reading, _BACKGROUND_ZERO, _BACKGROUND_PERCENT)


def name_color(red: int, green: int, blue: int, blank: int) -> Color:
    """Return the firmware's decision, based on the strongest of the three colours."""
    if red > blue and red > green:
        return _name_reddish(red, green, blue, blank)
    if green > blue:
        return _name_greenish(red, green, blue, blank)
    return _name_bluish(red, green, blue, blank)


def _name_reddish(red: int, green: int, blue: int, blank: int) -> Color:
    if red < 65 or (blank < 40 and red < 110):
        return Color.BLACK
    if blue + blue // 4 + blue // 8 < green and 2 * green > red:
        return Color.YELLOW
    if 2 * green - green // 4 < red:
        return Color.RED
    dark = blue < 70 or green < 70 or (blank < 140 and red < 140)
    return Color.BLACK if dark else Color.WHITE


def _name_greenish(red: int, green: int, blue: int, blank: int) -> Color:
    if green < 40 or (blank < 30 and green < 70):
        return Color.BLACK
    if 2 * blue < red:
        return Color.YELLOW
    if red + red // 4 < green or blue + blue // 4 < green:
        return Color.GREEN
    dark = red < 70 or blue < 70 or (blank < 140 and green < 140)
    return Color.BLACK if dark else Color.WHITE


def _name_bluish(red: int, green: int, blue: int, blank: int) -> Color:
    if blue < 48 or (blank < 25 and blue < 85):
        return Color.BLACK
    higher, lower = max(red, green), min(red, green)
    if higher * 48 // 32 < blue or lower * 58 // 32 < blue:
        return Color.BLUE
    if lower < 60 or (blank < 110 and blue < 120):
        return Color.BLACK
    return Color.BLUE if lower + lower // 8 < blue else Color.WHITE
