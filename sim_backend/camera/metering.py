"""Automatic exposure: the camera follows the brightness of the room with a delay."""

from __future__ import annotations

import math

WEAKEST, STRONGEST = 0.1, 10.0
"""Range of the gain and exposure time of a webcam, as factors. A guess."""


class Metering:
    """Brightness of the frames of a camera that adapts.

    Args:
        time_constant_s: Time constant of the adaptation; 0 for a fixed exposure.
    """

    def __init__(self, time_constant_s: float) -> None:
        self._time_constant_s = time_constant_s
        self._gain: float | None = None
        self._time_s = 0.0

    def brightness(self, light: float, time_s: float) -> float:
        """Return the brightness of the frame exposed at `time_s` in this light; times must not decrease."""
        if not self._time_constant_s:
            return light
        wanted = min(STRONGEST, max(WEAKEST, 1.0 / light))
        if self._gain is None:
            self._gain = wanted
        else:
            self._gain += (wanted - self._gain) * -math.expm1((self._time_s - time_s) / self._time_constant_s)
        self._time_s = time_s
        return light * self._gain
