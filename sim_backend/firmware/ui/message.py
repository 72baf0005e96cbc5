"""Messages that the menus and the radio show for some time. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters

SHORT, LONG, LONGEST = 1500, 2500, 3000
"""Times for which a message can be shown, in passes; others end at once."""

_ADDED = 100
_CHARACTERS = 12
"""Characters of a line that are drawn, one in each pass."""


class Message:
    """The message that is shown, with a step that no state but 0 and 13 resets: another message continues it.

    Attributes:
        step: 0 to 3 begin, erase, and draw picture and frame; 4 draws a line of text, 5 the first of two, 6 the second
            one; 7 waits, and 8 is the end.
        timer: Count of the passes that wait.
    """

    def __init__(self, clock: Clock, registers: UiRegisters, screen: ScreenRefresh) -> None:
        self._registers, self._screen = registers, screen
        self.step, self.timer, self._left = 0, PassCounter(clock), 0

    def show(self, first: int, second: int = 0, *, passes: int = 0) -> bool:
        """Run a pass of it; return whether it is over.

        Args:
            first: Characters of its first line.
            second: Those of its second one, 0 if it has one line.
            passes: How long it stays.
        """
        match self.step:
            case 0:
                self.step = 1
            case 1 | 2 | 3 if self._screen.drawing:
                pass
            case 1 | 2:
                self._screen.mark(marks.MESSAGE[self.step - 1])
                self.step += 1
            case 3:
                self._screen.mark(marks.MESSAGE[2])
                self.step, self._left = 5 if second else 4, first
            case 4 | 5 | 6 if self._left:
                self._left -= 1
            case 5:
                self.step, self._left = 6, min(second, _CHARACTERS)
            case 4 | 6:
                self.step, self.timer.value = 7, 0
            case 7:
                left = passes + _ADDED - self.timer.count()
                if left > 0:
                    self._registers.rest(left)
                else:
                    self.step = 8
            case _:
                self.step = 0
        return not self.step
