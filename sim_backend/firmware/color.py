"""The colour sensor's part of an input port: calibrating what it sees, and naming the colour.

Source: docs/firmware.md section 6.1. The wire protocol by which the sensor hands over its calibration is not simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import Protocol, runtime_checkable

from firmware_protocol.enums import SensorMode
from sim_backend.firmware.analog import FULL_SCALE, LEVEL, boolean

RED, GREEN, BLUE, BLANK = range(4)
"""Which lamp of the sensor is lit; blank is none."""

_BACKGROUND_ZERO, _BACKGROUND_PERCENT = 71, 93
_FACTOR_BITS = 16
_MODE, _SLOPE = 0xE0, 0x1F


class Color(IntEnum):
    """What the firmware calls a colour."""

    BLACK = 1
    BLUE = 2
    GREEN = 3
    YELLOW = 4
    RED = 5
    WHITE = 6


@runtime_checkable
class ColorDevice(Protocol):
    """A colour sensor as the firmware meets it.

    Attributes:
        calibration: Three rows of factors for red, green, blue and blank, in 1/65536: for bright, dimmer and dark
            surroundings.
        limits: Below these blank readings the second and the third row count.
    """

    calibration: Sequence[Sequence[int]]
    limits: Sequence[int]

    def lit(self, lamp: int) -> int:
        """The converter's value, 0..1023, while `lamp` is on."""


class ColorPort:
    """What the Input map shows of a colour sensor; rows of four are red, green, blue and blank.

    Attributes:
        device: What is plugged in, or None.
        calibration: All factors of the sensor, row after row.
        limits: As the sensor has them.
        readings: Of the converter.
        normalized: Readings without the background and calibrated.
        scaled: By the port's mode; modes that count or step do not apply to single colours and give 0.
        booleans: By the port's slope.
    """

    def __init__(self) -> None:
        self.device: ColorDevice | None = None
        self.calibration: tuple[int, ...] = (0,) * 12
        self.limits: tuple[int, ...] = (0, 0)
        nothing: tuple[int, ...] = (0, 0, 0, 0)
        self.readings = self.normalized = self.scaled = self.booleans = nothing

    def plug_in(self, device: ColorDevice | None) -> None:
        """Take over the calibration of another sensor."""
        self.device = device
        if device is not None:
            self.calibration = tuple(factor for row in device.calibration for factor in row)
            self.limits = tuple(device.limits)

    def look(self, device: ColorDevice, mode: int) -> Color:
        """Light one lamp after the other and name the colour."""
        self.readings = red, green, blue, blank = tuple(device.lit(lamp) for lamp in (RED, GREEN, BLUE, BLANK))
        row = device.calibration[sum(blank < limit for limit in device.limits)]
        lit = (max(0, reading - blank) for reading in (red, green, blue))
        before, last = self.normalized, self.booleans
        self.normalized = tuple(
            value * factor >> _FACTOR_BITS for value, factor in zip((*lit, background(blank)), row, strict=True)
        )
        slope, level = mode & _SLOPE, LEVEL.get(mode & _MODE)
        self.booleans = tuple(
            boolean(new, slope, *old) for new, *old in zip(self.normalized, before, last, strict=True)
        )
        if level is not None:
            self.scaled = tuple(map(level, self.normalized))
        else:
            self.scaled = self.booleans if mode & _MODE == SensorMode.BOOLEAN else (0, 0, 0, 0)
        return name_color(*self.normalized)


def background(reading: int) -> int:
    """The blank value, and that of the single lamps: not inverted, as those of the light sensor are."""
    return min(FULL_SCALE, max(0, reading - _BACKGROUND_ZERO) * 100 // _BACKGROUND_PERCENT)


def name_color(red: int, green: int, blue: int, blank: int) -> Color:
    """The firmware's decision, by the strongest of the three."""
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
