"""Battery voltage and warnings as in the firmware. Source: docs/firmware.md section 4 (0x0B) and section 8."""

from __future__ import annotations

FRESH_BATTERY = 560
"""Converter value of a good set of batteries, 7.75 V."""

RECHARGEABLE = 0x8000
"""Bit of the battery's converter value that marks the rechargeable pack."""

SAMPLE_MS = 167
_LOW_MV, _LOW_RECHARGEABLE_MV = 6100, 7100
_FULL_MV = 7500
_LOW_SAMPLES = 6
_LEVELS = 4


class Battery:
    """Voltage, sampled six times a second.

    Attributes:
        millivolts: Voltage at the last sample, refreshed every 167 ms.
    """

    def __init__(self) -> None:
        self._raw = FRESH_BATTERY
        self._low_samples = 0
        self.sample()

    @property
    def rechargeable(self) -> bool:
        """Whether the rechargeable pack is fitted."""
        return bool(self._raw & RECHARGEABLE)

    @property
    def bars(self) -> int:
        """Bars of the battery symbol, 0..4; only both ends of the scale were measured."""
        low = self._threshold_mv
        return min(max((self.millivolts - low) * _LEVELS // (_FULL_MV - low), 0), _LEVELS)

    @property
    def low(self) -> bool:
        """Whether the voltage was low in enough samples for a warning."""
        return self._low_samples >= _LOW_SAMPLES

    @property
    def settled(self) -> bool:
        """Whether the next sample would change nothing."""
        counting = self.millivolts < self._threshold_mv and not self.low
        return self.millivolts == self._now_mv and not counting

    def set(self, raw: int) -> None:
        """Change the battery: a 10-bit converter value, plus `RECHARGEABLE`."""
        self._raw = raw

    def sample(self) -> None:
        """Take a sample."""
        self.millivolts = self._now_mv
        self._low_samples = self._low_samples + 1 if self.millivolts < self._threshold_mv else 0

    @property
    def _now_mv(self) -> int:
        return (self._raw & 0x3FF) * 13848 // 1000

    @property
    def _threshold_mv(self) -> int:
        return _LOW_RECHARGEABLE_MV if self.rechargeable else _LOW_MV


def next_sample_ms(now_ms: int) -> int:
    """Pass of the next sample."""
    return (now_ms // SAMPLE_MS + 1) * SAMPLE_MS
