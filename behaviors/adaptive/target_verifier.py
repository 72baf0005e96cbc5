"""Target or look-alike: Wald's sequential test on how steadily the detector finds it.

A detector finds the real target in most frames from near enough, and a look-alike only now and then. Each frame shifts
the odds; the test stops as soon as they are clear enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True, slots=True)
class VerifierTuning:
    """Tuning constants of the test; docs/adaptive.md shows what they lead to.

    Attributes:
        clear_rate: Share of the frames in which the real target is found at least, in good light.
        unclear_rate: Share of the frames in which a look-alike is found at most.
        clear: Log odds at which it is clear whether it is found like the one or like the other.
        real_rate: Share of the frames in which the real target is found, in poor light.
        mistake_rate: Share of the frames in which a look-alike is found.
        accept: Log odds at which the test accepts: a wrong stop is worse than another look.
        reject: Log odds at which it rejects.
    """

    clear_rate: float = 0.90
    unclear_rate: float = 0.60
    clear: float = math.log(100.0)
    real_rate: float = 0.60
    mistake_rate: float = 0.30
    accept: float = math.log(300.0)
    reject: float = -math.log(500.0)


TUNING = VerifierTuning()
_HIT = math.log(TUNING.real_rate / TUNING.mistake_rate)
_MISS = math.log((1.0 - TUNING.real_rate) / (1.0 - TUNING.mistake_rate))
_CLEAR_HIT = math.log(TUNING.clear_rate / TUNING.unclear_rate)
_CLEAR_MISS = math.log((1.0 - TUNING.clear_rate) / (1.0 - TUNING.unclear_rate))


class Verdict(StrEnum):
    """The result of the test so far."""

    REAL = "real"
    MISTAKEN = "mistaken"
    OPEN = "open"


@dataclass(slots=True)
class TargetVerifier:
    """The odds that the object approached is the target.

    Attributes:
        odds: Their natural logarithm; 0 is even.
        clarity: Log odds that it is found as steadily as only the target can be.
    """

    odds: float = 0.0
    clarity: float = 0.0
    _missed: int = 0

    def frame(self, *, hit: bool) -> None:
        """Update the odds with a frame that shows the target's place.

        Frames without a detection count only when the next detection comes: until then the target may be hidden.
        """
        if hit:
            self.odds = max(2 * TUNING.reject, min(2 * TUNING.accept, self.odds + _HIT + self._missed * _MISS))
            change = _CLEAR_HIT + self._missed * _CLEAR_MISS
            self.clarity = max(-2 * TUNING.clear, min(2 * TUNING.clear, self.clarity + change))
            self._missed = 0
        else:
            self._missed += 1

    def forget_misses(self) -> None:
        """Drop frames without a detection: the target was hidden or out of the frame."""
        self._missed = 0

    @property
    def clear(self) -> bool:
        """Whether it is found as steadily as only the target can be, in good light."""
        return self.clarity >= TUNING.clear

    @property
    def unclear(self) -> bool:
        """Whether it is found no more steadily than a look-alike, or than the target in poor light."""
        return self.clarity <= -TUNING.clear

    @property
    def verdict(self) -> Verdict:
        """The result at the current odds."""
        if self.odds >= TUNING.accept:
            return Verdict.REAL
        return Verdict.MISTAKEN if self.odds <= TUNING.reject else Verdict.OPEN
