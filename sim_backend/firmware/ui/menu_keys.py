"""The keys of the menus, and the states that each of them goes through. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states
from sim_backend.firmware.ui.file_runner import FileRunner
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState

_COUNTED_MS = 50
"""Period of the count of passes of a value in old firmware."""


class MenuKeys:
    """Follows a key in the menus, one state in each pass."""

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        menu: Menu,
        files: FileRunner,
        screen: ScreenRefresh,
    ) -> None:
        self._clock, self._registers, self._keys, self._menu, self._files = clock, registers, keys, menu, files
        self._screen, self._drawn_ms, self._set_up_ms, self._left_ms = screen, 0, 0, 0

    @property
    def active(self) -> bool:
        """Whether keys are for the menus."""
        registers = self._registers
        shown = registers.state in states.IN_MENU or self._menu.states.shown
        hidden = registers.from_menu or registers.state == UiState.LOW_BATTERY
        return registers.is_on and shown and not hidden

    @property
    def awaited(self) -> bool:
        """Whether a key counts: the menu is drawn."""
        menu = self._menu
        shown = menu.shows_value or menu.message.shown or menu.naming.shown or self._logs
        return self._registers.is_on and (shown or self._registers.state == UiState.WAITING)

    @property
    def _logs(self) -> bool:
        """Whether a data log runs, and shows its values."""
        return self._menu.logs.log.runs and not self._menu.states.shown

    def follow(self) -> None:
        """Follow a key, if it counts."""
        menu = self._menu
        key = self._keys.read() if self.awaited else 0
        if self._logs:
            self._follow_log(key)
        elif menu.shows_value:
            self._follow_view(key)
        elif key:
            if menu.message.shown:
                self.close_message()
            else:
                menu.press(key)
                self.show()

    def _follow_view(self, key: int) -> None:
        """Leave the value that is shown, or set it up again, in the next pass; work due in this pass comes first."""
        registers, view, now_ms = self._registers, self._menu.view, self._clock.now_ms
        if key not in (Key.ENTER, Key.EXIT):
            return
        if now_ms >= registers.next_step_ms:
            self.show_value(draws=key != Key.EXIT)
        if key == Key.EXIT:
            self.keep_count()
            self._menu.leave_view()
        else:
            view.set_up_again()
            self._set_up_ms = now_ms if view.modern else self._set_up_ms
        registers.next_step_ms = now_ms + 1

    def close_message(self) -> None:
        """Close a message: a key was pressed, or its time is over."""
        self._menu.message.close()
        self.show()

    def _follow_log(self, key: int) -> None:
        """Draw a value of the running data log, or end the log, in the next pass; work due in this pass comes first."""
        registers, log, now_ms = self._registers, self._menu.logs.log, self._clock.now_ms
        if key not in (Key.LEFT, Key.RIGHT, Key.EXIT):
            return
        if now_ms >= registers.next_step_ms:
            self.go_on_with_log(writes=key != Key.EXIT)
        if self._menu.states.shown:
            return
        if key == Key.EXIT:
            self._menu.leave_log()
        else:
            log.choose(1 if key == Key.RIGHT else -1)
        registers.next_step_ms = now_ms + 1

    def go_on_with_log(self, *, writes: bool = True) -> None:
        """Take the next step of the data log that runs. A sample that could not be written ends it by a message."""
        log, now_ms = self._menu.logs.log, self._clock.now_ms
        failed, next_ms = log.fails, log.go_on(writes=writes)
        self._registers.next_step_ms = now_ms + 1 if log.fails else next_ms
        if failed:
            self._fail_log()

    def _fail_log(self) -> None:
        """End the data log by a message."""
        self._screen.mark(marks.LOG_FAILS)
        message = drawing.LOG_FAILED if self._menu.logs.log.runs else drawing.LOG_NOT_BEGUN
        self._menu.leave_log(message)
        self.show()

    def keep_count(self) -> None:
        """Keep the count of passes of a value that is shown by old firmware, which a state 3 continues."""
        view = self._menu.view
        if self._menu.shows_value and not view.modern:
            self._files.count = (self._clock.now_ms - self._set_up_ms - 1) % _COUNTED_MS + 1

    def leave_page(self, state: int) -> None:
        """Leave a value or a file that was run from its page, which `state` showed, for another state."""
        if state in (UiState.DRAWING, UiState.RUNNING):
            self._left_ms = self._clock.now_ms

    def resume_page(self, *, paused: bool) -> bool:
        """Resume a page, or a `paused` file, where it was left; return whether there is one."""
        registers, menu, now_ms = self._registers, self._menu, self._clock.now_ms
        has_page = menu.has_page and not menu.states.shown
        if not (paused if registers.state == UiState.RUNNING else has_page):
            return False
        passed_ms = now_ms - self._left_ms
        if registers.state == UiState.RUNNING:
            self._files.delay(passed_ms)
        elif menu.view.shown:
            self._drawn_ms, self._set_up_ms = self._drawn_ms + passed_ms, self._set_up_ms + passed_ms
        else:
            registers.from_menu = True
            self._files.delay(passed_ms)
        registers.next_step_ms = now_ms
        return True

    def end_page(self) -> None:
        """End the value or the data log that is shown, when the state of a key follows: a file can be started then."""
        menu, registers = self._menu, self._registers
        if self._clock.now_ms < registers.next_step_ms or menu.states.coming in (None, UiState.DRAWING):
            return
        if menu.view.shown:
            registers.clear(UiFlag.BUSY)
            menu.view.end()
        elif menu.logs.log.runs:
            registers.clear(UiFlag.BUSY)
            menu.logs.log.end()

    def show(self) -> None:
        """Show the next state of a key; after the last one wait for another key, run a file, or switch off."""
        registers, menu = self._registers, self._menu
        state = menu.states.next()
        if state is not None:
            registers.state, registers.next_step_ms = int(state), self._clock.now_ms + 1
        elif menu.runs is not None:
            self._files.begin_from_menu(menu.runs)
        elif menu.view.chosen:
            self._begin_view()
        elif menu.logs.begins:
            if menu.logs.begin():
                registers.set(UiFlag.BUSY)
                registers.next_step_ms = self._clock.now_ms + 1
            else:
                self._fail_log()
        elif menu.message.shown:
            registers.next_step_ms = self._clock.now_ms + menu.message.lasts_ms
        elif menu.naming.shown:
            registers.next_step_ms = NEVER
        else:
            registers.state = int(UiState.WAITING)
            registers.force_off = registers.force_off or int(menu.switches_off)
            menu.switches_off = False

    def _begin_view(self) -> None:
        """Show the value of a sensor or motor; the state stays as it is."""
        view = self._menu.view
        self._registers.set(UiFlag.BUSY | UiFlag.REDRAW_STATUS)
        self._screen.mark(marks.VALUE)
        view.shown, self._drawn_ms = True, self._clock.now_ms
        self._set_up_ms = self._drawn_ms
        if view.modern:
            self._registers.next_step_ms = self._clock.now_ms + 1
        else:
            view.set_up()
            self._await_value()

    def show_value(self, *, draws: bool = True) -> None:
        """Set up the port of the value that is shown, check it, and draw the value again.

        Args:
            draws: Whether the value is drawn when that is due; in the pass of exit it is not.
        """
        view, now_ms = self._menu.view, self._clock.now_ms
        passed_ms = now_ms - self._set_up_ms
        if view.chosen:
            view.set_up()
        if passed_ms % view.step_ms == 0:
            view.check_ports(passed_ms)
        if draws and (now_ms - self._drawn_ms) % view.period_ms == 0:
            self._screen.mark(marks.VALUE_AGAIN)
        self._await_value()

    def _await_value(self) -> None:
        """Wait for the next look at the ports, which enter delays, or the next drawing of the value."""
        now_ms, period_ms, step_ms = self._clock.now_ms, self._menu.view.period_ms, self._menu.view.step_ms
        waits_ms = step_ms - (now_ms - self._set_up_ms) % step_ms
        self._registers.next_step_ms = now_ms + min(waits_ms, period_ms - (now_ms - self._drawn_ms) % period_ms)
