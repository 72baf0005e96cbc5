"""The page of the menus that runs a data log. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.page import Page
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import Marks


class LogPage:
    """Runs the log until exit is pressed, or a sample cannot be written.

    Args:
        leave: Called then, with the drawing of a message, if there is one.

    Attributes:
        page: The page.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        screen: ScreenRefresh,
        logs: LogMenu,
        leave: Callable[[Sequence[Marks]], None],
    ) -> None:
        self._clock, self._registers, self._keys, self._screen = clock, registers, keys, screen
        self._logs, self._leave = logs, leave
        self.page = Page(self._begin, self._go_on)

    def _begin(self) -> None:
        if self._logs.begin():
            self._registers.set(UiFlag.BUSY)
            self._registers.wake_in(1)
        else:
            self._fail(drawing.LOG_NOT_BEGUN)

    def _go_on(self) -> None:
        """Take the next step of the log. A sample is not written in the pass of exit."""
        log, key, failed = self._logs.log, self._keys.read(), self._logs.log.fails
        next_ms = log.go_on(writes=key != Key.EXIT)
        if failed:
            self._fail(drawing.LOG_FAILED)
        elif key == Key.EXIT:
            self._leave(())
        else:
            if key in (Key.LEFT, Key.RIGHT):
                log.choose(1 if key == Key.RIGHT else -1)
            self._registers.wake_in(1 if log.fails or log.draws else next_ms - self._clock.now_ms)

    def _fail(self, message: Sequence[Marks]) -> None:
        """End the log by a message."""
        self._screen.mark(marks.LOG_FAILS)
        self._leave(message)

    def end(self) -> None:
        """Leave the page: a file can be started then."""
        self._registers.clear(UiFlag.BUSY)
        self._logs.log.end()
