"""Prediction from readings of a motion's wheels when to brake: distance left, speed, time of the brake command."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

CREEP_DEG_S = 60.0
"""Speed of the last stretch: six counts per regulation period."""
START_S = 0.16
"""From rest a regulated motor does nothing for one period of 101 ms (docs/firmware.md section 1, fact 15), and its own
inertia holds it back for TAU, 60 ms (section 0.2)."""
SEEN_DEG_S = 20.0
"""Speed from which a wheel counts as moving."""
BRAKING_S = 0.015
"""A braked motor still turns by its speed times this time. Source: docs/firmware.md section 0.2, TAUBRAKE."""
WINDOW_S = 0.08
"""Window for measuring the speed; a single count within a single cycle would be too coarse."""


class BrakePredictor:
    """Predicts from readings of the wheels when to brake.

    Attributes:
        remaining_deg: To the goal; negative beyond it.
        covered_deg: Since the first reading.
        speed_deg_s: Towards the goal, over the last `WINDOW_S`; 0 before the second reading.

    Args:
        weights: One weight per wheel in their mean.
        creep_deg_s: Speed of the last stretch of this motion: `CREEP_DEG_S`, or that of the whole motion if it is
            slower.
    """

    def __init__(self, weights: Sequence[float], creep_deg_s: float) -> None:
        self._weights = weights
        self._creep_deg_s = creep_deg_s
        self.remaining_deg = self.covered_deg = self.speed_deg_s = 0.0
        self._readings: deque[tuple[float, float]] = deque()
        self._first_deg = self._began_s = self._now_s = 0.0
        self._direction = 1.0

    def update(self, time_s: float, remaining_deg: Sequence[float]) -> None:
        """Add a reading: its time, and each wheel's degrees to the goal."""
        mean_deg = weighted_mean(remaining_deg, self._weights)
        readings = self._readings
        if not readings:
            self._first_deg, self._began_s, self._direction = mean_deg, time_s, math.copysign(1, mean_deg)
        self._now_s, self.remaining_deg, self.covered_deg = time_s, mean_deg, abs(self._first_deg - mean_deg)
        readings.append((time_s, mean_deg))
        while len(readings) > 2 and time_s - readings[1][0] >= WINDOW_S:
            readings.popleft()
        then_s, before_deg = readings[0]
        if time_s > then_s:
            self.speed_deg_s = (before_deg - mean_deg) / (time_s - then_s) * self._direction

    def brake_at(self, delay_s: float) -> float:
        """Predict when to send the brake command, on the link's clock.

        A moving wheel reaches the goal after `remaining_deg` / `speed_deg_s`. If its speed is too low to be measured,
        that of its command is used. A motion too short to measure a speed is predicted from its first command, which
        starts the regulator's period.

        Args:
            delay_s: Round trip of the link; half of it passes before the brake acts.
        """
        remaining_deg = self.remaining_deg * self._direction
        if remaining_deg <= 0:
            return 0.0
        if self.speed_deg_s >= SEEN_DEG_S:
            return self._now_s + remaining_deg / self.speed_deg_s - BRAKING_S - delay_s / 2
        if self.covered_deg and self._creep_deg_s < CREEP_DEG_S:
            return self._now_s + remaining_deg / self._creep_deg_s - BRAKING_S - delay_s / 2
        first_s = self._first_deg * self._direction / self._creep_deg_s
        return self._began_s + delay_s / 2 + START_S + first_s - BRAKING_S


def weighted_mean(values: Sequence[float], weights: Sequence[float]) -> float:
    """Return the mean of values with one weight each."""
    return sum(weight * value for weight, value in zip(weights, values, strict=True)) / sum(weights)
