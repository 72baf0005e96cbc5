"""The page of the menus that shows the value of a sensor or motor. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu_items import PORTS, Call
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sensor_view import SensorView
from sim_backend.firmware.ui.states import UiState

_COUNTED_PASSES = 50
"""Old firmware counts the passes of this page by the timer that states share, from 1 to this number."""


class ViewPage:
    """The function VIEW: it draws the value again and again, until exit is pressed.

    Attributes:
        drawn: Count of passes by which it is drawn.
        checked: Count of passes by which the ports are looked at.
    """

    def __init__(
        self, clock: Clock, registers: UiRegisters, keys: KeyInput, screen: ScreenRefresh, view: SensorView
    ) -> None:
        self._registers, self._keys, self._screen, self._view = registers, keys, screen, view
        self.drawn = PassCounter(clock)
        self.checked = PassCounter(clock) if view.modern else registers.timer

    def run(self, argument: int) -> bool:
        """Choose a value, or show it: step 1 goes on, and 2 leaves the page; a file can be started then."""
        registers, view = self._registers, self._view
        match registers.step:
            case 0 if argument == Call.OPEN:
                self._screen.mark(marks.LIST)
                view.clear()
            case 0 if argument < PORTS:
                view.item = argument - 1
            case 0 if argument < Call.LEFT:
                view.choose(argument - PORTS)
                self._begin()
            case 0:
                pass
            case 1:
                self._go_on()
            case _:
                registers.clear(UiFlag.BUSY)
                view.end()
                registers.end(UiState.EXIT)
        return bool(registers.step)

    def _begin(self) -> None:
        self._registers.set(UiFlag.BUSY | UiFlag.REDRAW_STATUS)
        self._registers.step = 1
        self._screen.mark(marks.VALUE)
        self.drawn.restart()
        self.checked.restart()
        self._view.sets_up = True
        if not self._view.modern:
            self._view.set_up()
        self._await_value()

    def _go_on(self) -> None:
        """Set up the port, look at it, and draw its value; enter sets it up again."""
        view, key, drawn, checked = self._view, self._keys.read(), self.drawn.count(), self.checked.count()
        if not view.modern and checked > _COUNTED_PASSES:
            self.checked.value = checked = checked - _COUNTED_PASSES
        if view.sets_up:
            view.set_up()
        if checked % view.step_ms == 0:
            view.check_ports(checked)
        if drawn % view.period_ms == 0 and key != Key.EXIT:
            self._screen.mark(marks.VALUE_AGAIN)
        self._await_value()
        if key == Key.EXIT:
            self._screen.mark(marks.LIST)
            self._registers.step = 2
            self._registers.rest(1)
        elif key == Key.ENTER:
            view.set_up_again()
            self.checked.value = 0 if view.modern else checked
            self._registers.rest(1)

    def _await_value(self) -> None:
        """Wait for the next look at the ports, or the next drawing of the value."""
        view, drawn, checked = self._view, self.drawn.value, self.checked.value
        waits = min(view.step_ms - checked % view.step_ms, view.period_ms - drawn % view.period_ms)
        self._registers.rest(1 if view.sets_up else waits)
