"""The sleep timer of the user interface. Source: docs/firmware.md section 8."""

from __future__ import annotations

from sim_backend.firmware.module import Clock

MINUTE_MS = 60_000


class SleepTimer:
    """Time since the brick was last used.

    Attributes:
        limit_minutes: Time until power-off, 0 for never.
        rests: Whether it is reset in each pass: the brick never sleeps, or a data log runs.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.limit_minutes = 0
        self._started_ms = 0
        self.rests = False

    def restart(self, now_ms: int) -> None:
        """Count from `now_ms` on, that pass included."""
        self._started_ms = now_ms - 1

    def rest(self, now_ms: int) -> None:
        """Reset it in this pass and in those to come, up to the next call of `follow_request`."""
        self.restart(now_ms)
        self.rests = True

    @property
    def minutes(self) -> int:
        """Whole minutes since the timer was last reset, 8 bits."""
        return 0 if self.rests else self._minutes & 0xFF

    @minutes.setter
    def minutes(self, minutes: int) -> None:
        self.rests = False
        self._started_ms += (self._minutes - minutes) * MINUTE_MS

    @property
    def _minutes(self) -> int:
        return (self._clock.now_ms - self._started_ms) // MINUTE_MS

    def follow_request(self, now_ms: int, *, resets: bool) -> None:
        """Reset the timer on request; a brick that never sleeps does so in each pass."""
        if resets or self.rests:
            self.restart(now_ms if resets else now_ms - 1)
        self.rests = resets and not self.limit_minutes

    @property
    def expired(self) -> bool:
        """Whether it is time to switch off; checked whenever a minute is over."""
        over = self._clock.now_ms == self._started_ms + self._minutes * MINUTE_MS
        return 0 < self.limit_minutes <= self.minutes and over

    @property
    def expires_ms(self) -> int:
        """Earliest time to switch off, if the sleep time is not 0."""
        return self._started_ms + max(self.limit_minutes, self._minutes + 1) * MINUTE_MS

    @property
    def limit_ms(self) -> int:
        """Time until power-off in ms, 0 for never."""
        return self.limit_minutes * MINUTE_MS
