"""Convert the AD converter's value to a program's reading: normalisation by type, scaling by mode.

Source: docs/firmware.md section 6.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.cint import divide, s16

FULL_SCALE = 1023
"""Largest value of the 10-bit converter; also the reading of an open port."""

MODE_BITS, SLOPE_BITS = 0xE0, 0x1F
"""Bits of a commanded mode: the mode itself, and the change that counts as a press."""

_PRESSED_BELOW = 460
"""Normalized values above it give boolean 0."""

_COLDEST = 290
"""Raw value of the temperature sensor with the highest normalized value; raw values below it give the same."""

_TEMPERATURE_STEPS = (
    "2121212212121212121112111211211112111121111111111112111111111111111111111111111101111111011110111110"
    "1111011111011111011101110110111011101101111011011101101101101101101101101101101101101101011011010110"
    "1011010110101101011010110110101011010110101010101101010101101010101101010101101100101010110101010110"
    "1010101010101101010101010110101010101010101010101010101010110101010101010101011001011010101010101010"
    "1011010101010101011010101010110101010101010101011010110101010101010110101101010101101010110101010110"
    "1101011010110101101101011011011010110101101101101101011101101110110111011011011011110111101110111110"
    "11111111011111111110111111111111111011"
)
"""Number of the 450 steps of 0.2 °C down from 70 °C that each raw value from 291 on takes, measured one by one."""

_TEMPERATURE = tuple(FULL_SCALE * (450 - taken) // 450 for taken in accumulate(map(int, "0" + _TEMPERATURE_STEPS)))
"""Normalized value of each raw value from `_COLDEST` on."""

_BANDS = (450, 675, 910)
"""Borders of the rotation sensor's four bands: 440, 660 and 890 per mille of full scale."""

_ORDER = (0, 1, 3, 2)
"""The bands in the order in which a turning shaft passes them; the reverse order is the other direction."""

_STEPS = {1: 1, 3: -1}
_OUTERMOST = (0, 2)
"""Places of the lowest and the highest band in that order."""

_STANDSTILL = 30
"""Passes in one band after which the shaft stands still."""

_CONFIRMATION = 7
"""Passes."""


def full_scale(raw: int, zero: int, percent: int) -> int:
    """Return the value of a sensor whose range begins at `zero` and is `percent` of the converter's, 0..1023."""
    return min(FULL_SCALE, divide(max(0, raw - zero) * 100, percent))


def _inverted(zero: int, percent: int) -> Callable[[int], int]:
    def normalize(raw: int) -> int:
        return FULL_SCALE - full_scale(raw, zero, percent)

    return normalize


def _temperature(raw: int) -> int:
    return _TEMPERATURE[min(max(raw - _COLDEST, 0), len(_TEMPERATURE) - 1)]


def _unchanged(raw: int) -> int:
    return raw


NORMALIZE: dict[int, Callable[[int], int]] = {
    SensorType.SWITCH: _unchanged,
    SensorType.TEMPERATURE: _temperature,
    SensorType.REFLECTION: _inverted(476, 41),
    SensorType.ANGLE: _unchanged,
    SensorType.LIGHT_ACTIVE: _inverted(200, 68),
    SensorType.LIGHT_INACTIVE: _inverted(200, 68),
    SensorType.SOUND_DB: _inverted(162, 83),
    SensorType.SOUND_DBA: _inverted(162, 83),
}
"""Raw to normalized, by type; the scale of `SensorType.CUSTOM` is in the map."""


def celsius(normalized: int) -> int:
    """Return the temperature in tenths of a degree."""
    return 900 * normalized // FULL_SCALE - 200


def fahrenheit(normalized: int) -> int:
    """Return the temperature in tenths of a degree; below 0 °C the firmware's unsigned arithmetic is wrong."""
    return s16((celsius(normalized) * 180 & 0xFFFF_FFFF) // 100 + 320)


LEVEL: dict[int, Callable[[int], int]] = {
    SensorMode.RAW: _unchanged,
    SensorMode.PERCENT: lambda normalized: 100 * normalized // FULL_SCALE,
    SensorMode.CELSIUS: celsius,
    SensorMode.FAHRENHEIT: fahrenheit,
}
"""Modes whose scaled value depends only on the normalized one."""


def boolean(normalized: int, slope: int, before: int) -> int:
    """Return whether a sensor is "pressed".

    Args:
        normalized: 0..1023.
        slope: 0 for a fixed threshold, otherwise the change that counts.
        before: The normalized value of the previous pass.
    """
    if not slope:
        return int(normalized <= _PRESSED_BELOW)
    if normalized > FULL_SCALE - slope:
        return 0
    return int(normalized < slope or before - normalized > slope)


class RotationDisc:
    """The disc of the rotation sensor: its four bands, followed step by step."""

    def __init__(self) -> None:
        self._position = self._standstill = 0

    def turn(self, normalized: int) -> int:
        """Follow the disc to the band of this reading.

        From the two outermost bands, the disc also moves through the next band on its way to the one after it. After a
        standstill there, the step to it counts only when it has been read `_CONFIRMATION` times.

        Args:
            normalized: 0..1023.

        Returns:
            Sixteenths of a turn: +1, -1, or 0 for the same or the opposite band, which changes nothing.
        """
        new = _ORDER.index(sum(normalized >= border for border in _BANDS))
        steps = _STEPS.get((new - self._position) % len(_ORDER), 0)
        if new == self._position:
            self._standstill = max(self._standstill, min(self._standstill + 1, _STANDSTILL))
        if not steps:
            return 0
        if steps > 0 and self._position in _OUTERMOST and 0 <= self._standstill - _STANDSTILL < _CONFIRMATION - 1:
            self._standstill += 1
            return 0
        self._position, self._standstill = new, 0
        return steps
