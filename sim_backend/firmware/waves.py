"""The waves of tones on the loudspeaker. Source: docs/firmware.md section 6.2."""

from __future__ import annotations

from math import ceil

_CLOCK_HZ = 48_054_850
_WAVE_CLOCKS = 1024
"""Clocks per wave of a tone, times the divider of the clock."""

_LOWEST_HZ, _HIGHEST_HZ, _REST_HZ = 220, 14_080, 1000
"""Range of tones, and the frequency of a rest (0 Hz)."""

_SHORTEST_MS = 10

QUEUED = 2
"""Waves, or pieces of a file, that still play when the firmware has handed over the last one and ends the sound."""


class Waves:
    """The waves of the last tone."""

    def __init__(self) -> None:
        self._wave_ms = self._begin_ms = self._end_ms = self._idle_ms = 0.0

    def begin(self, frequency_hz: int, duration_ms: int, now_ms: int, rest_ms: float) -> int:
        """Begin a tone when the wave that is on the loudspeaker ends.

        Tones of more than a hundred waves or so are longer than commanded, as the divider of the clock is rounded up.

        Args:
            frequency_hz: 0 is a rest.
            duration_ms: As commanded.
            now_ms: The present pass.
            rest_ms: How long another sound is still on the loudspeaker.

        Returns:
            The pass in which the last wave is handed over.
        """
        hertz = min(max(frequency_hz, _LOWEST_HZ), _HIGHEST_HZ) if frequency_hz else _REST_HZ
        waits_ms = max(rest_ms, self.rest_ms(now_ms))
        waves = hertz * max(duration_ms, _SHORTEST_MS) // 1000 - 1
        handed_over = waves - 1 - QUEUED * hertz // 1000
        self._wave_ms = period_ms(_WAVE_CLOCKS, hertz)
        self._begin_ms = now_ms + waits_ms
        self._end_ms = self._begin_ms + waves * self._wave_ms
        self._idle_ms = self._end_ms + 1
        return max(now_ms + 1, ceil(self._begin_ms + handed_over * self._wave_ms))

    def rest_ms(self, now_ms: int) -> float:
        """Return how long the wave on the loudspeaker still takes, a whole one if the last ended in this pass."""
        if now_ms >= self._end_ms:
            return self._wave_ms if now_ms < self._idle_ms else 0.0
        if now_ms < self._begin_ms:  # it is the last one of another tone
            return self._begin_ms - now_ms
        return self._wave_ms - (now_ms - self._begin_ms) % self._wave_ms

    def cut(self, now_ms: int) -> None:
        """Stop the waves after the one that is on the loudspeaker."""
        if now_ms < self._end_ms:
            self._end_ms = self._idle_ms = now_ms + self.rest_ms(now_ms)

    def stop(self) -> None:
        """Stop the waves."""
        self._end_ms = self._idle_ms = 0.0


def period_ms(clocks: int, hertz: int) -> float:
    """Return the milliseconds of a wave or sample; the divider of the clock is an integer, rounded up."""
    return ceil(_CLOCK_HZ / clocks / hertz) * clocks * 1000 / _CLOCK_HZ
