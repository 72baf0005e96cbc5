"""The picture of a file that runs. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters

_PASSES = 125


class RunningSign:
    """Changes the picture from time to time while the status bar is shown.

    Attributes:
        shown: Count of the passes since the last change.
    """

    def __init__(self, clock: Clock, registers: UiRegisters, screen: ScreenRefresh) -> None:
        self._registers, self._screen, self.shown = registers, screen, PassCounter(clock)

    def begin(self) -> None:
        """Erase the screen for it."""
        self._screen.mark(marks.RUNNING)
        self.shown.value = 0

    def turn(self) -> None:
        """Count a pass, and rest until the next change."""
        left = _PASSES
        if self._registers.flags & UiFlag.ENABLE_STATUS:
            left -= self.shown.count()
            if left <= 0:
                self._screen.mark(marks.PLAYING)
                self.shown.value, left = 0, _PASSES
        self._registers.rest(left)

    def end(self) -> None:
        """Draw what was there before."""
        self._screen.mark(marks.RAN)
