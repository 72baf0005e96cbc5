"""Target or look-alike: Wald's sequential test on how steadily the detector finds it.

A detector finds the real target in most frames from near enough, and a look-alike only now and then. Each frame shifts
the odds; the test stops as soon as they are clear enough. docs/adaptive.md shows what the constants lead to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

CLEAR_RATE = 0.90
"""Share of the frames in which the real target is found at least, in good light."""
UNCLEAR_RATE = 0.60
"""Share of the frames in which a look-alike is found at most."""
CLEAR_LOG_ODDS = math.log(100.0)
"""Log odds at which it is clear whether it is found like the one or like the other."""
REAL_RATE = 0.60
"""Share of the frames in which the real target is found, in poor light."""
MISTAKE_RATE = 0.30
"""Share of the frames in which a look-alike is found."""
ACCEPT_LOG_ODDS = math.log(300.0)
"""Log odds at which the test accepts: a wrong stop is worse than another look."""
REJECT_LOG_ODDS = -math.log(500.0)
"""Log odds at which it rejects."""
_HIT = math.log(REAL_RATE / MISTAKE_RATE)
_MISS = math.log((1.0 - REAL_RATE) / (1.0 - MISTAKE_RATE))
_CLEAR_HIT = math.log(CLEAR_RATE / UNCLEAR_RATE)
_CLEAR_MISS = math.log((1.0 - CLEAR_RATE) / (1.0 - UNCLEAR_RATE))


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
            self.odds = max(2 * REJECT_LOG_ODDS, min(2 * ACCEPT_LOG_ODDS, self.odds + _HIT + self._missed * _MISS))
            change = _CLEAR_HIT + self._missed * _CLEAR_MISS
            self.clarity = max(-2 * CLEAR_LOG_ODDS, min(2 * CLEAR_LOG_ODDS, self.clarity + change))
            self._missed = 0
        else:
            self._missed += 1

    def forget_misses(self) -> None:
        """Drop frames without a detection: the target was hidden or out of the frame."""
        self._missed = 0

    @property
    def clear(self) -> bool:
        """Whether it is found as steadily as only the target can be, in good light."""
        return self.clarity >= CLEAR_LOG_ODDS

    @property
    def unclear(self) -> bool:
        """Whether it is found no more steadily than a look-alike, or than the target in poor light."""
        return self.clarity <= -CLEAR_LOG_ODDS

    @property
    def verdict(self) -> Verdict:
        """The result at the current odds."""
        if self.odds >= ACCEPT_LOG_ODDS:
            return Verdict.REAL
        return Verdict.MISTAKEN if self.odds <= REJECT_LOG_ODDS else Verdict.OPEN
