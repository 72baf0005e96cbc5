"""Convert the converter's value to what a program reads: normalisation by type, scaling by mode.

Source: docs/firmware.md section 6.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from functools import cache
from itertools import pairwise

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.cint import s16

FULL_SCALE = 1023
"""Largest value of the 10-bit converter; also the reading of an open port."""

_PRESSED_BELOW = 460
"""Normalized values above it give boolean 0."""

_TEMPERATURE = {
    290: 1023, 300: 986, 400: 747, 450: 666, 460: 650, 500: 593, 512: 577, 550: 527,
    562: 511, 563: 511, 600: 466, 700: 345, 800: 220, 899: 61, 900: 59, 928: 0,
}  # fmt: skip
"""Raw to normalized at the measured points of the firmware's table, with a smooth curve in between. With one point left
out at a time, the curve is within 2 of the points from 400 to 600 and of 899, and within 7 of the others."""

_KNOTS = tuple(raw for raw in _TEMPERATURE if raw not in (460, 563, 899))
"""Points that define the curve; the others lie too close to a neighbour to give a slope after rounding."""

_BANDS = (450, 675, 910)
"""Borders of the rotation sensor's four bands: 440, 660 and 890 per mille of full scale."""

_ORDER = (0, 1, 3, 2)
"""The bands in the order in which a turning shaft passes them; the reverse order is the other direction."""


def _inverted(zero: int, percent: int) -> Callable[[int], int]:
    def normalize(raw: int) -> int:
        return FULL_SCALE - min(FULL_SCALE, max(0, raw - zero) * 100 // percent)

    return normalize


def _slopes() -> list[float]:
    """Slope of the curve at each knot: that of the parabola through it and its neighbours."""
    widths = [right - left for left, right in pairwise(_KNOTS)]
    chords = [(_TEMPERATURE[right] - _TEMPERATURE[left]) / (right - left) for left, right in pairwise(_KNOTS)]
    inner = [
        (chords[i] * widths[i + 1] + chords[i + 1] * widths[i]) / (widths[i] + widths[i + 1])
        for i in range(len(chords) - 1)
    ]
    return [2 * chords[0] - inner[0], *inner, 2 * chords[-1] - inner[-1]]


@cache
def _temperature(raw: int) -> int:
    raw = min(max(raw, _KNOTS[0]), _KNOTS[-1])
    if raw in _TEMPERATURE:
        return _TEMPERATURE[raw]
    i = bisect_left(_KNOTS, raw)
    left, right, slopes = _KNOTS[i - 1], _KNOTS[i], _slopes()
    width, t = right - left, (raw - left) / (right - left)
    start, end = _TEMPERATURE[left], _TEMPERATURE[right]
    return round(
        start * (1 + 2 * t) * (1 - t) ** 2
        + end * t * t * (3 - 2 * t)
        + width * t * (1 - t) * (slopes[i - 1] * (1 - t) - slopes[i] * t)
    )


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
    SensorType.CUSTOM: _unchanged,
}
"""Raw to normalized, by analog type; other types are not evaluated."""


def celsius(normalized: int) -> int:
    """Temperature in tenths of a degree."""
    return 900 * normalized // FULL_SCALE - 200


def fahrenheit(normalized: int) -> int:
    """Temperature in tenths of a degree; below 0 °C the firmware's unsigned arithmetic gives garbage."""
    return s16((celsius(normalized) * 180 & 0xFFFF_FFFF) // 100 + 320)


LEVEL: dict[int, Callable[[int], int]] = {
    SensorMode.RAW: _unchanged,
    SensorMode.PERCENT: lambda normalized: 100 * normalized // FULL_SCALE,
    SensorMode.CELSIUS: celsius,
    SensorMode.FAHRENHEIT: fahrenheit,
}
"""Modes whose scaled value depends only on the normalized one."""


def boolean(normalized: int, slope: int, before: int, last: int) -> int:
    """Whether a sensor is "pressed".

    Args:
        normalized: 0..1023.
        slope: 0 for a fixed threshold, otherwise the change that counts.
        before: The normalized value of the previous pass.
        last: The boolean of the previous pass; returned where the firmware's result is undefined.
    """
    if not slope:
        return int(normalized <= _PRESSED_BELOW)
    if normalized > FULL_SCALE - slope:
        return 0
    if normalized < slope or before - normalized > slope:
        return 1
    if normalized - before > slope:
        return 0
    return last


def band(normalized: int) -> int:
    """Position of the rotation sensor's disc in its cycle of four."""
    return _ORDER.index(sum(normalized >= border for border in _BANDS))


def step(before: int, now: int) -> int:
    """Sixteenths of a turn between two bands: +1, -1, or 0 for an impossible step."""
    return {1: 1, 3: -1}.get((now - before) % 4, 0)
