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
from sim_backend.firmware.ui.page import CurrentPage
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.question import Question
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState

_REPORT = (marks.NOTHING, *marks.REPORT)
"""What the message draws, pass by pass."""


class RadioDialog:
    """Shows the radio's question or message, and ends its request; what is interrupted continues where it was."""

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        menu: Menu,
        current: CurrentPage,
        screen: ScreenRefresh,
        sound: SoundModule,
        radio: Radio,
    ) -> None:
        self._registers, self._keys, self._menu, self._current = registers, keys, menu, current
        self._screen, self._sound, self._radio = screen, sound, radio
        self._parts, self.shown = [*_REPORT], PassCounter(clock)
        self._question = Question(screen, partial(registers.set, UiFlag.REDRAW_STATUS))

    def follow(self) -> None:
        """Show the radio's request, unless the user interface is busy."""
        registers = self._registers
        pending = self._radio.state & (RadioState.ASKING | RadioState.REPORTING)
        shown = UiState.QUESTION if pending & RadioState.ASKING else UiState.REPORT
        if pending and not registers.flags & UiFlag.BUSY and registers.state != shown:
            registers.go_to(shown)
            self._current.interrupt()
        if pending and registers.state in states.RADIO_SHOWN:
            registers.set(UiFlag.BUSY)

    def redraw(self) -> None:
        """Draw them once more when they continue: a file was opened, or the brick was started."""
        self._question.redraw()
        self._parts, self.shown.value = [*_REPORT], 0

    def ask(self) -> None:
        """Draw the question, or follow a key, until it is answered."""
        question = self._question
        self._registers.wake_in(1)
        if not question.sounded:
            question.sounded = True
            self._sound.play_own(ATTENTION, self._registers.volume)
        elif question.waits:
            question.press(self._keys.read())
        elif question.go_on():
            question.begin()
            self._end(RadioState.ASKING)

    def report(self) -> None:
        """Draw the message part by part, each when the previous one is drawn; later end it."""
        registers = self._registers
        if self._parts:
            if not (self._parts[0].waits and self._screen.drawing):
                self._screen.mark(self._parts.pop(0))
            registers.wake_in(1)
            return
        left = times.REPORT_PASSES - self.shown.count()
        if left > 0:
            registers.wake_in(left)
            return
        self._parts, self.shown.value = [*_REPORT], 0
        self._end(RadioState.REPORTING)

    def _end(self, state: RadioState) -> None:
        """End the request: continue a page, or draw the main menu, unless a file was requested."""
        self._radio.state &= ~int(state)
        self._registers.clear(UiFlag.BUSY)
        self._registers.go_to(UiState.MENU)
        if not self._current.stays:
            self._menu.reset()
