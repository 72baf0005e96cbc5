"""Requests of the radio to the user interface: a question, or a message. Source: docs/firmware.md section 8."""

from __future__ import annotations

from functools import partial

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_answers import RadioState
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import ATTENTION, SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.question import Question
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import Marks
from sim_backend.firmware.ui.states import UiState


class RadioDialog:
    """Shows the radio's question or message, and ends its request."""

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        menu: Menu,
        screen: ScreenRefresh,
        sound: SoundModule,
        radio: Radio,
    ) -> None:
        self._clock, self._registers, self._keys, self._menu = clock, registers, keys, menu
        self._screen, self._sound, self._radio = screen, sound, radio
        self._report: list[Marks] = []
        self._question = Question(screen, partial(registers.set, UiFlag.REDRAW_STATUS))

    def follow(self) -> None:
        """Show the radio's request, unless the user interface is busy."""
        registers = self._registers
        pending = self._radio.state & (RadioState.ASKING | RadioState.REPORTING)
        shown = UiState.QUESTION if pending & RadioState.ASKING else UiState.REPORT
        busy = registers.flags & UiFlag.BUSY or registers.from_menu or registers.starting
        if pending and not busy and registers.state != shown:
            registers.state = int(shown)
            self.begin(shown, delay_ms=1)
            self._menu.interrupt()
        if pending and registers.state in states.RADIO_SHOWN:
            registers.set(UiFlag.BUSY)

    def begin(self, state: int, *, delay_ms: int = 0) -> None:
        """Begin with what a state of `RADIO_SHOWN` shows; with a question after a delay."""
        if state == UiState.QUESTION:
            self._question.begin()
        else:
            self._report, delay_ms = [*marks.REPORT], 2
        self._registers.next_step_ms = self._clock.now_ms + delay_ms

    def go_on_with_question(self) -> None:
        """Draw the question, or follow a key, until it is answered."""
        question = self._question
        if not question.sounded:
            question.sounded = True
            self._sound.play_own(ATTENTION, self._registers.volume)
        elif question.waits:
            question.press(self._keys.read())
        elif question.go_on():
            self._end(RadioState.ASKING)
            return
        self._registers.next_step_ms = self._clock.now_ms + 1

    def follow_report(self) -> None:
        """Draw a message part by part, each when the previous one is drawn; later end it."""
        if self._registers.state != UiState.REPORT or self._clock.now_ms < self._registers.next_step_ms:
            return
        if not self._report:
            self._end(RadioState.REPORTING)
            return
        shown_ms = 1
        if not self._screen.drawing:
            self._screen.mark(self._report.pop(0))
            shown_ms = 1 if self._report else times.REPORT_MS
        self._registers.next_step_ms = self._clock.now_ms + shown_ms

    def _end(self, state: RadioState) -> None:
        """End the request: continue a page, or draw the main menu, unless a file was requested, or the brick is off."""
        registers = self._registers
        self._radio.state &= ~int(state)
        registers.clear(UiFlag.BUSY)
        registers.state, registers.next_step_ms = int(UiState.MENU), self._clock.now_ms + 1
        if registers.is_on:
            if not self._menu.has_page:
                self._menu.reset()
            self._menu.go_on_from(registers.state)
