"""A detector for nxtdrive: lamps and other bright spots.

In a mission:

    [target.lamp]
    detector = "lamp"
    least_brightness = 220
    height_mm = 60
"""

from __future__ import annotations

import cv2
import numpy as np

from nxtdrive.errors import ConfigError
from nxtdrive.vision.detection import Detection, Image
from nxtdrive.vision.detectors.spec import DetectorSpec


class LampDetector:
    """Finds compact places that are brighter than a limit.

    Args:
        least_brightness: 1 to 254; a frame's values end at 255.
        least_px: A lamp is at least this wide and high in the frame.

    Raises:
        ConfigError: The brightness is out of range.
    """

    def __init__(self, least_brightness: int = 220, least_px: int = 4) -> None:
        if not 1 <= least_brightness <= 254:
            raise ConfigError(
                f"least_brightness = {least_brightness} is not valid.", remedy="It lies between 1 and 254."
            )
        self._least_brightness, self._least_px = least_brightness, least_px

    def detect(self, image: Image) -> list[Detection]:
        """Return all lamps in a BGR frame, the largest first; the score is the share of the box that is bright."""
        gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        bright = (gray > self._least_brightness).astype(np.uint8)
        count, _, stats, _ = cv2.connectedComponentsWithStats(bright)
        found = []
        for left, top, width, height, area in stats[1:count].tolist():
            if min(width, height) >= self._least_px:
                found.append(Detection((left, top, width, height), area / (width * height)))
        return sorted(found, key=lambda one: -one.box[2] * one.box[3])


def from_spec(spec: DetectorSpec) -> LampDetector:
    """Make the detector from a target's keys; keys that are not taken here are reported as mistakes."""
    return LampDetector(spec.take("least_brightness", int, 220), spec.take("least_px", int, 4))
