"""A text that is entered with the keys: a PIN, or the name of a program. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from string import ascii_lowercase

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.button import Button, ButtonState
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.registers import UiRegisters

_END = ""
"""The item that ends the entry."""
_RING = (*"0987654321", _END, *ascii_lowercase)

_LONGEST = 15
_OVER = 100


class TextEntry:
    """The entry of a text, with a step that only its end and state 13 reset.

    Args:
        enter: The button whose long press makes the last letter a capital one.

    Attributes:
        text: What was entered, or what is offered at the beginning.
        step: 0 erases, 1 draws the text, 2 the characters; 3 follows keys; others end the entry.
    """

    def __init__(self, registers: UiRegisters, keys: KeyInput, screen: ScreenRefresh, enter: Button) -> None:
        self._registers, self._keys, self._screen, self._enter = registers, keys, screen, enter
        self.text, self.step, self._place, self._length, self._is_offered = "", 0, 0, 0, False

    def run(self) -> bool:
        """Run a pass; return whether the entry is over."""
        screen = self._screen
        match self.step:
            case 0:
                screen.mark(marks.TEXT[0])
                self.step, self._place, self._length, self._is_offered = 1, _RING.index(_END), len(self.text), True
            case 1 if not screen.erase_mask & marks.TEXT[0].erase:
                screen.mark(marks.TEXT[1])
                self.step = 2
            case 2 if not screen.erase_mask & marks.CHARACTER.erase:
                if _RING[self._place] == _END:
                    screen.mark(marks.TEXT[2])
                self.step = 3
            case 1 | 2:
                pass
            case 3:
                if self._enter.state & ButtonState.LONG_PRESS and self._length:
                    self._raise_last()
                self._press(self._keys.read())
            case _:
                screen.mark(marks.ANSWERED)
                self._registers.set(UiFlag.REDRAW_STATUS)
                self.step = 0
        return not self.step

    def _raise_last(self) -> None:
        """Make the last character a capital letter, if it is a small one."""
        last = self.text[self._length - 1 : self._length]
        if last in ascii_lowercase:
            self._change(last.upper(), self._length - 1)

    def _change(self, character: str, at: int) -> None:
        """End the text with a character at a place, or with none, and draw it."""
        self.text, self.step = self.text[:at] + character, self.step - 2

    def _press(self, key: int) -> None:
        """Follow a key: choose, add or delete a character, or end the entry.

        The first exit deletes all of the text that is offered, and exit without a character ends.
        """
        character = _RING[self._place]
        match key:
            case Key.LEFT | Key.RIGHT:
                self._place = (self._place + (1 if key == Key.RIGHT else -1)) % len(_RING)
                self._screen.mark(marks.CHARACTER)
                self.step -= 2
            case Key.ENTER if character == _END:
                self.step = _OVER
            case Key.ENTER:
                self._is_offered = False
                if self._length < _LONGEST:
                    self._change(character, self._length)
                    self._length += 1
            case Key.EXIT if self._length:
                self._length = 0 if self._is_offered else self._length - 1
                self._is_offered = False
                self._change("", self._length)
            case Key.EXIT:
                self.text, self.step = "", _OVER
