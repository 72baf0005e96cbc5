"""The user interface's supervision of battery and power. Source: docs/firmware.md section 8."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware import screen_marks as marks
from sim_backend.firmware import ui_states as states
from sim_backend.firmware import ui_times as times
from sim_backend.firmware.battery import Battery
from sim_backend.firmware.button import Button
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.keys import Key, Keys
from sim_backend.firmware.menu import Menu
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.question import Question
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_answers import RadioState
from sim_backend.firmware.screen_marks import Marks
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sleep_timer import SleepTimer
from sim_backend.firmware.ui_states import DrawStatus, Programs, UiState


class Supply:
    """The warning of a low battery, and switching off.

    Attributes:
        battery: The supply.
        sleep_timer: Decides when to switch off.
        programs: The command module; set by the brick.
        radio: The radio; set by the brick.
        draw_status: Draws the status bar; set by the brick.
        flags: See `firmware_protocol.iomap.UiFlag`.
        state: See `UiState`.
        force_off: Nonzero to switch the brick off.
    """

    programs: Programs
    radio: Radio
    draw_status: DrawStatus
    buttons: Sequence[Button]
    _menu: Menu
    _keys: Keys
    _answered: bool
    _starting: bool

    def __init__(self, clock: Clock, io_control: IoControl, screen: ScreenRefresh) -> None:
        self._clock, self.sleep_timer = clock, SleepTimer(clock)
        self._io_control, self._screen = io_control, screen
        self.battery, self.force_off = Battery(), 0
        self.flags, self.state = int(UiFlag.ENABLE_STATUS), int(UiState.WAITING)
        self._next_step_ms = self._off_ms = self._down_ms = NEVER
        self._leaves_radio = False
        self._warned = self._from_menu = False
        self._warned_in = UiState.START
        self._warned_ms = 0
        self._report: list[Marks] = []
        self._question = Question(screen, self._redraw_bar)

    def watch_supply(self) -> None:
        """Warn of a low battery once; switch off, the display before the power, when the sleep timer has expired."""
        now_ms = self._clock.now_ms
        if self._warns and not self._screen.drawing:
            self._warned, self._warned_in = True, UiState.WAITING if self._off_ms == NEVER else UiState.DRAWING
            self.flags |= int(UiFlag.BUSY)
            self.state, self._next_step_ms = int(UiState.LOW_BATTERY), NEVER
            self._warned_ms = now_ms
            self._screen.mark(marks.WARNING)
            self.draw_status(everything=False)
            self._screen.pop_up()
        if self.sleep_timer.expired and self._off_ms == NEVER:
            self.force_off = 1
        if self.force_off:
            if now_ms >= self._down_ms + times.DEAF_MS:
                self._io_control.take_back()
            self._off_ms, self._down_ms = now_ms, NEVER
            self.state, self._next_step_ms, self._from_menu = int(UiState.DRAWING), NEVER, False
        elif self.state != UiState.DRAWING and self._before_power_down(now_ms):
            self._screen.on &= now_ms < self._off_ms + times.DISPLAY_OFF_MS - 1
            self._off_ms = NEVER
        elif now_ms == self._off_ms + 1 and self.programs.active:
            self.programs.stop()
        self.force_off = 0
        self._switch_off(now_ms - self._off_ms)

    def _before_power_down(self, now_ms: int) -> bool:
        """Return whether the decision to switch off was made, but the radio has not ended its connections."""
        return now_ms < self._off_ms + times.DISPLAY_OFF_MS or (self._leaves_radio and self.radio.seems_busy)

    def _switch_off(self, passed_ms: int) -> None:
        """Switch display and power off, each a pass after the maps show it; later take keys again."""
        now_ms = self._clock.now_ms
        if passed_ms >= times.DISPLAY_OFF_MS - 1:
            self._screen.on = False
            if passed_ms >= times.DISPLAY_OFF_MS and self._screen.switches:
                self._io_control.display_on = False
        if passed_ms == times.DISPLAY_OFF_MS - 1:
            self._leaves_radio = self.radio.disconnect()
        elif passed_ms >= 0 and self._down_ms == NEVER and not self._before_power_down(now_ms):
            self._down_ms = now_ms
        down_ms = now_ms - self._down_ms
        if down_ms == times.DEAF_MS and not self._from_menu and self.state not in states.STARTED:
            self._io_control.take_back()
        elif down_ms == 0:
            self._io_control.announce_power_down()
        elif 0 < down_ms < times.DEAF_MS:
            self._io_control.send()

    def watch_radio(self) -> None:
        """Show the radio's request, a question or a message, unless the user interface is busy."""
        if self.state == UiState.REPORT and self._clock.now_ms >= self._next_step_ms:
            self._show_report()
        asks = self.radio.state & (RadioState.ASKING | RadioState.REPORTING)
        shown = UiState.QUESTION if asks & RadioState.ASKING else UiState.REPORT
        busy = self.flags & UiFlag.BUSY or self._from_menu or self._starting
        if asks and not busy and self.state != shown:
            self.state = int(shown)
            if shown == UiState.QUESTION:
                self._next_step_ms = self._clock.now_ms + 1
                self._question.begin()
            else:
                self.begin_report()
            self._menu.interrupt()
        if asks and self.state in states.RADIO_SHOWN:
            self.flags |= int(UiFlag.BUSY)

    @property
    def _warns(self) -> bool:
        return self.battery.low and not self._warned and self.state in states.MENU_SHOWN and not self._from_menu

    def _redraw_bar(self) -> None:
        """Draw the whole status bar in this pass, or when it is shown again."""
        self.flags |= int(UiFlag.REDRAW_STATUS)

    def _mark_framed(self, drawn: Marks) -> None:
        """Draw parts of the screen, the frame only with the status bar."""
        frame = 0 if self.flags & UiFlag.ENABLE_STATUS else marks.FRAME
        self._screen.mark(drawn._replace(update=drawn.update & ~frame))

    def begin_report(self) -> None:
        """Show a message of the radio."""
        self._report, self._next_step_ms = [*marks.REPORT], self._clock.now_ms + 2

    def _show_report(self) -> None:
        """Draw the message part by part, each when the previous one is drawn; later end it."""
        if not self._report:
            self.end_report(RadioState.REPORTING)
            return
        shown_ms = 1
        if not self._screen.drawing:
            self._mark_framed(self._report.pop(0))
            shown_ms = 1 if self._report else times.REPORT_MS
        self._next_step_ms = self._clock.now_ms + shown_ms

    def end_report(self, state: RadioState) -> None:
        """End a question or message of the radio: draw the menu again, unless a file was requested meanwhile."""
        self.radio.state &= ~int(state)
        self.flags &= ~int(UiFlag.BUSY)
        self.state, self._next_step_ms = int(UiState.MENU), self._clock.now_ms + 1
        self._menu.go_on_from(self.state)

    def _answers(self, now_ms: int) -> bool:
        """Return whether a button closes the warning: one pressed since then, or left or right when it counts again."""
        if self.state != UiState.LOW_BATTERY or self._warning_is_new(now_ms):
            return False
        key = self._keys.read(self.buttons, now_ms)
        return self._answered or (key is not None and not self._disabled(key))

    def _warning_is_new(self, now_ms: int) -> bool:
        return self.state == UiState.LOW_BATTERY and now_ms < self._warned_ms + times.WARNING_DEAF_MS

    def _disabled(self, key: int) -> bool:
        return bool(self.flags & (UiFlag.DISABLE_EXIT if key == Key.EXIT else UiFlag.DISABLE_LEFT_RIGHT_ENTER))
