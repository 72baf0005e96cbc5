"""Finds a patch of saturated colour: the cheapest detector, and the one most easily fooled."""

from __future__ import annotations

import cv2
import numpy as np

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, Image
from nxtdrive.vision.detectors.spec import DetectorSpec

HUES = {"red": 0, "orange": 14, "yellow": 28, "green": 60, "cyan": 92, "blue": 112, "magenta": 150}
"""Centre of each colour in OpenCV's hues: 0 to 179, half degrees."""

HUE_REACH = 8
MIN_SATURATION = 110
MIN_VALUE = 50
MIN_SIDE_PX = 8
MIN_FILL = 0.6
"""Least share of the box that has the colour: a sheet of paper fills its box, a cable does not."""


class ColorDetector:
    """Finds compact patches of a named colour. The score is the share of the box that has the colour.

    Args:
        color: One of `HUES`.

    Raises:
        ConfigError: There is no such colour.
    """

    def __init__(self, color: str) -> None:
        if color not in HUES:
            raise ConfigError(f"There is no colour {color!r}.", remedy=f"Use one of: {', '.join(HUES)}.")
        self._hue = HUES[color]

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
        low, high = self._hue - HUE_REACH, self._hue + HUE_REACH
        mask = cv2.inRange(hsv, _bound(low, MIN_SATURATION, MIN_VALUE), _bound(high, 255, 255))
        if low < 0:
            other_end = cv2.inRange(hsv, _bound(low + 180, MIN_SATURATION, MIN_VALUE), _bound(179, 255, 255))
            mask = cv2.bitwise_or(mask, other_end)
        return mask


def from_spec(spec: DetectorSpec) -> ColorDetector:
    """Make the detector from ``color``."""
    return ColorDetector(spec.take("color", str))


def _bound(hue: int, saturation: int, value: int) -> cv2.typing.MatLike:
    return np.array([max(0, hue), saturation, value], np.uint8)
