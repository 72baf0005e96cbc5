"""Requests of the radio to the user interface: a question, or a message. Source: docs/firmware.md section 8."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_answers import RadioState
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import ATTENTION, SoundModule
from sim_backend.firmware.ui import message
from sim_backend.firmware.ui.message import Message
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.text_entry import TextEntry

_PIN = "1234"
"""The one that is offered."""

_NOT_SAVED, _FULL = 0x51, 0x52
_TEXTS = {_NOT_SAVED: (12, 6), _FULL: (11, 11)}
_OTHER_TEXT = (10, 12)
"""Characters of the two lines of the message, by the error."""


class RadioDialog:
    """The states QUESTION and REPORT.

    Args:
        go_home: Goes to the main menu.
    """

    def __init__(
        self,
        registers: UiRegisters,
        screen: ScreenRefresh,
        sound: SoundModule,
        radio: Radio,
        shown: Message,
        text: TextEntry,
        go_home: Callable[[], None],
    ) -> None:
        self._registers, self._screen, self._sound, self._radio = registers, screen, sound, radio
        self._message, self._text, self._go_home, self._step = shown, text, go_home, 0

    def follow(self) -> None:
        """Show the radio's request, unless the user interface is busy."""
        registers = self._registers
        for asks, shown in ((RadioState.ASKING, UiState.QUESTION), (RadioState.REPORTING, UiState.REPORT)):
            if self._radio.shown_state & asks and not registers.flags & UiFlag.BUSY:
                registers.set(UiFlag.BUSY)
                registers.go_to(shown)

    def ask(self) -> None:
        """Ask for a PIN over the normal screen, with a step of its own."""
        match self._step:
            case 0:
                self._sound.play_own(ATTENTION, self._registers.volume)
                self._step = 1
            case 1 if not self._screen.drawing:
                self._screen.pop_up()
                self._step = 2
            case 2:
                self._text.text, self._step = _PIN, 3
                self._registers.set(UiFlag.REDRAW_STATUS)
            case 3 if self._text.run():
                self._step = 4
            case 4 if not self._screen.drawing:
                self._screen.show_normal()
                self._step = 0
                self._end(RadioState.ASKING)

    def report(self) -> None:
        """Show the message about an error."""
        first, second = _TEXTS.get(self._registers.error, _OTHER_TEXT)
        if self._message.show(first, second, passes=message.LONG):
            self._end(RadioState.REPORTING)

    def _end(self, state: RadioState) -> None:
        """End the request: the menus go on from the main menu, with the function that was interrupted."""
        self._radio.state &= ~int(state)
        self._go_home()
        self._registers.clear(UiFlag.BUSY)
        self._registers.go_to(UiState.MENU)
