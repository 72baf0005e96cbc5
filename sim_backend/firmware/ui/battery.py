"""Battery voltage and warnings as in the firmware. Source: docs/firmware.md sections 4 (0x0B) and 8."""

from __future__ import annotations

FRESH_BATTERY = 560
"""Converter value of a good set of batteries, 7.75 V."""

RECHARGEABLE = 0x8000
"""Bit of the battery's converter value that marks the rechargeable pack."""

SAMPLE_MS = 167
_LOW_SAMPLES = 6
_LEVELS_MV = (6100, 6500, 7000, 7500)
_LEVELS_RECHARGEABLE_MV = (7100, 7200, 7300, 7500)
_HYSTERESIS_MV, _HYSTERESIS_RECHARGEABLE_MV = 100, 50
"""One more bar is shown only above its level and the hysteresis."""


class Battery:
    """Voltage, sampled six times a second.

    Attributes:
        raw: Converter value, plus `RECHARGEABLE`.
        millivolts: Voltage at the last sample, refreshed every 167 ms.
        rechargeable: Whether the rechargeable pack was fitted at the last sample.
        bars: Bars of the battery symbol at the last sample, 0..4.
    """

    def __init__(self) -> None:
        self.raw = FRESH_BATTERY
        self._started_ms = self._empty_samples = 0
        self.bars = len(_LEVELS_MV)
        self.sample()

    def restart(self, started_ms: int) -> None:
        """Drop the samples and take the first new one a period after `started_ms`."""
        self._started_ms, self._empty_samples, self.bars = started_ms, 0, 0

    def since_sample_ms(self, now_ms: int) -> int:
        """Return the time since the last sample, or since the start."""
        return (now_ms - self._started_ms) % SAMPLE_MS

    def next_sample_ms(self, now_ms: int) -> int:
        """Pass of the next sample."""
        return now_ms + SAMPLE_MS - self.since_sample_ms(now_ms)

    def skipped(self, due_ms: int, until_ms: int) -> int:
        """Return the sample to take instead of the one at `due_ms`, if those up to `until_ms` change nothing.

        Two are left before then: icons depend on the number of samples, and the drawing on the icons before.
        """
        left_out = (until_ms - due_ms) // SAMPLE_MS - 2
        left_out -= left_out % 2  # the icon of an empty battery alternates
        if left_out <= 0 or self.since_sample_ms(due_ms) or not self.settled:
            return due_ms
        return due_ms + left_out * SAMPLE_MS

    def samples(self, now_ms: int) -> int:
        """Return the number of samples since the start."""
        return (now_ms - self._started_ms) // SAMPLE_MS

    @property
    def empty(self) -> bool:
        """Whether the symbol has no bar, after the last sample."""
        return self._empty_samples > 0

    @property
    def shown_bars(self) -> int:
        """Bars of the icon: that of an empty battery has one bar after every second sample, from the first one on."""
        return self.bars + self._empty_samples % 2

    @property
    def low(self) -> bool:
        """Whether the symbol had no bar in enough samples for a warning."""
        return self._empty_samples >= _LOW_SAMPLES

    @property
    def settled(self) -> bool:
        """Whether the next samples change nothing."""
        counting = not self.bars and not self.low
        same = self.millivolts == self._now_mv and self.rechargeable == bool(self.raw & RECHARGEABLE)
        return same and self.bars == self._bars_at(self.millivolts) and not counting

    def sample(self) -> None:
        """Take a sample."""
        self.millivolts, self.rechargeable = self._now_mv, bool(self.raw & RECHARGEABLE)
        self.bars = self._bars_at(self.millivolts)
        self._empty_samples = 0 if self.bars else self._empty_samples + 1

    @property
    def _now_mv(self) -> int:
        return (self.raw & 0x3FF) * 13848 // 1000

    def _bars_at(self, millivolts: int) -> int:
        levels = _LEVELS_RECHARGEABLE_MV if self.rechargeable else _LEVELS_MV
        hysteresis = _HYSTERESIS_RECHARGEABLE_MV if self.rechargeable else _HYSTERESIS_MV
        bars = sum(millivolts > level for level in levels)
        if bars == self.bars + 1 and millivolts <= levels[self.bars] + hysteresis:
            return self.bars
        return bars
