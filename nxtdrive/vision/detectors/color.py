"""Find a patch of saturated colour: the cheapest detector, and the one most easily fooled."""

from __future__ import annotations

import cv2
import numpy as np

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, Image
from nxtdrive.vision.detectors.spec import DetectorSpec

HUES = {"red": 0, "orange": 14, "yellow": 28, "green": 60, "cyan": 92, "blue": 112, "magenta": 150}
"""Centre of each colour in OpenCV's hues: 0 to 179, half degrees."""

HUE_REACH = 8
"""How far a hue may be from the colour's centre, in OpenCV's hues."""

MIN_SATURATION, MIN_VALUE = 110, 50
"""Minimum saturation and value of a pixel that has the colour, 0 to 255."""

SHADE_LIMITS = {
    "hue_deg": (0, 360),
    "reach_deg": (0, 180),
    "min_saturation_percent": (0, 100),
    "min_value_percent": (0, 100),
}
"""Least and greatest value of each number that says how a colour looks."""

MIN_SIDE_PX = 8
"""Smaller patches are not reported."""

MIN_FILL = 0.6
"""Minimum share of the box that has the colour: a sheet of paper fills its box, a cable does not."""


def default_shade(color: str) -> dict[str, float]:
    """Return the arguments of `ColorDetector` for a colour that was not calibrated.

    Raises:
        ConfigError: There is no such colour.
    """
    if color not in HUES:
        raise ConfigError(f"there is no colour {color!r}.", remedy=f"Use one of: {', '.join(HUES)}.")
    least = {"min_saturation_percent": round(MIN_SATURATION / 2.55, 1), "min_value_percent": round(MIN_VALUE / 2.55, 1)}
    return {"hue_deg": 2.0 * HUES[color], "reach_deg": 2.0 * HUE_REACH, **least}


class ColorDetector:
    """Finds compact patches of a named colour. The score is the share of the box that has the colour.

    Args:
        color: One of `HUES`.
        shade: How it looks in this camera and light: ``hue_deg``, ``reach_deg``, ``min_saturation_percent``,
            ``min_value_percent``; missing ones are as `default_shade` says.

    Raises:
        ConfigError: There is no such colour, or a number is out of range.
    """

    def __init__(self, color: str, **shade: float) -> None:
        shade = {**default_shade(color), **shade}
        for key, (least, most) in SHADE_LIMITS.items():
            if not least <= shade[key] <= most:
                raise ConfigError(
                    f"{key} = {shade[key]:g} is not valid.", remedy=f"It lies between {least} and {most}."
                )
        self._hue, self._reach = round(shade["hue_deg"] / 2), round(shade["reach_deg"] / 2)
        self._saturation = round(2.55 * shade["min_saturation_percent"])
        self._value = round(2.55 * shade["min_value_percent"])

    def detect(self, image: Image) -> list[Detection]:
        """Return all patches, the largest first."""
        hsv = cv2.cvtColor(cv2.GaussianBlur(image, (3, 3), 0), cv2.COLOR_BGR2HSV)
        mask = cv2.morphologyEx(self._mask(hsv), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        count, _, stats, _ = cv2.connectedComponentsWithStats(mask)
        found = []
        for left, top, width, height, area in stats[1:count].tolist():
            fill = area / (width * height)
            if min(width, height) >= MIN_SIDE_PX and fill >= MIN_FILL:
                found.append((area, Detection((left, top, width, height), fill)))
        return [detection for _, detection in sorted(found, key=lambda pair: -pair[0])]

    def _mask(self, hsv: cv2.typing.MatLike) -> cv2.typing.MatLike:
        """Return 255 where a pixel has the colour; red lies at both ends of the hues."""
        low, high = self._hue - self._reach, self._hue + self._reach
        mask = self._between(hsv, low, high)
        for turn in (180, -180):
            if low + turn < 180 and high + turn >= 0:
                mask = cv2.bitwise_or(mask, self._between(hsv, low + turn, high + turn))
        return mask

    def _between(self, hsv: cv2.typing.MatLike, low: int, high: int) -> cv2.typing.MatLike:
        lower = np.array([max(0, low), self._saturation, self._value], np.uint8)
        return cv2.inRange(hsv, lower, np.array([min(179, high), 255, 255], np.uint8))


def from_spec(spec: DetectorSpec) -> ColorDetector:
    """Make the detector from ``color``, and how that looks."""
    color = spec.take("color", str)
    return ColorDetector(color, **{key: spec.take(key, float, usual) for key, usual in default_shade(color).items()})
