"""Counts of passes that also count those which the scheduler skips."""

from __future__ import annotations

from sim_backend.firmware.module import NEVER, Clock


class PassCounter:
    """A count of passes: what counts in a pass also counts in the skipped ones after it.

    `settle` begins each pass that runs, and so ends the counting of the pass before.

    Attributes:
        value: The count.
    """

    __slots__ = ("_at_ms", "_clock", "_limit", "_rate", "value")

    def __init__(self, clock: Clock, value: int = 0) -> None:
        self._clock, self.value = clock, value
        self._rate, self._at_ms, self._limit = 0, clock.now_ms, NEVER

    def settle(self) -> None:
        """Count the skipped passes before this one."""
        now_ms = self._clock.now_ms
        if self._rate:
            self.value = max(self.value, min(self.value + self._rate * (now_ms - 1 - self._at_ms), self._limit))
        self._rate, self._at_ms, self._limit = 0, now_ms, NEVER

    def count(self, limit: int = NEVER) -> int:
        """Count this pass once more, and the skipped ones after it, up to a limit; return the count."""
        if self.value < limit:
            self.value += 1
        self._rate, self._limit = self._rate + 1, min(self._limit, limit)
        return self.value

    def restart(self) -> None:
        """Count from 1 on, from the next pass on."""
        self.value, self._rate = 0, 1
