"""The page of the menus that shows the value of a sensor or motor. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.page import Page
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sensor_view import SensorView

_COUNTED_PASSES = 50
"""Old firmware counts the passes of this page by the timer that states share, from 1 to this number."""


class ViewPage:
    """Draws the value again and again, until exit is pressed.

    Args:
        leave: Called then.

    Attributes:
        page: The page.
        drawn: Count of passes by which it is drawn.
        checked: Count of passes by which the ports are looked at.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        screen: ScreenRefresh,
        view: SensorView,
        leave: Callable[[], None],
    ) -> None:
        self._registers, self._keys, self._screen, self._view, self._leave = registers, keys, screen, view, leave
        self.page = Page(self._begin, self._go_on, stays=True)
        self.drawn = PassCounter(clock)
        self.checked = PassCounter(clock) if view.modern else registers.timer

    def _begin(self) -> None:
        self._registers.set(UiFlag.BUSY | UiFlag.REDRAW_STATUS)
        self._screen.mark(marks.VALUE)
        self.drawn.restart()
        self.checked.restart()
        self._view.sets_up = True
        if not self._view.modern:
            self._view.set_up()
        self._await_value()

    def _go_on(self) -> None:
        """Set up the port, look at it, and draw its value, but not in the pass of exit; enter sets it up again."""
        view, key, drawn, checked = self._view, self._keys.read(), self.drawn.count(), self.checked.count()
        if not view.modern and checked > _COUNTED_PASSES:
            self.checked.value = checked = checked - _COUNTED_PASSES
        if view.sets_up:
            view.set_up()
        if checked % view.step_ms == 0:
            view.check_ports(checked)
        if key == Key.EXIT:
            self._screen.mark(marks.LIST)
            self._leave()
            return
        if drawn % view.period_ms == 0:
            self._screen.mark(marks.VALUE_AGAIN)
        if key == Key.ENTER:
            view.set_up_again()
            self.checked.value = 0 if view.modern else checked
        self._await_value()

    def _await_value(self) -> None:
        """Wait for the next look at the ports, or the next drawing of the value."""
        view, drawn, checked = self._view, self.drawn.value, self.checked.value
        waits = min(view.step_ms - checked % view.step_ms, view.period_ms - drawn % view.period_ms)
        self._registers.wake_in(1 if view.sets_up else waits)

    def end(self) -> None:
        """Leave the page: a file can be started then."""
        self._registers.clear(UiFlag.BUSY)
        self._view.end()
