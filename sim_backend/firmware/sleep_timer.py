"""The sleep timer of the user interface. Source: docs/firmware.md section 8."""

from __future__ import annotations

from sim_backend.firmware.module import Clock

MINUTE_MS = 60_000
SLEEP_MINUTES = 10
"""Time until power-off after the start."""


class SleepTimer:
    """Time since the brick was last used.

    Attributes:
        sleep_minutes: Time until power-off, 0 for never.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.sleep_minutes = SLEEP_MINUTES
        self._timer_started_ms = 0

    @property
    def sleep_timer(self) -> int:
        """Whole minutes since the timer was last reset."""
        return (self._clock.now_ms - self._timer_started_ms) // MINUTE_MS if self.sleep_minutes else 0

    @sleep_timer.setter
    def sleep_timer(self, minutes: int) -> None:
        self._timer_started_ms += (self.sleep_timer - minutes) * MINUTE_MS

    @property
    def sleep_ms(self) -> int:
        """Time until power-off in ms, 0 for never."""
        return self.sleep_minutes * MINUTE_MS
