"""The user interface's question whether to accept a connection, which the radio requests.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.keys import Key

_OK, _PLACES = 0, 37
"""The item that ends the entry, and the number of items in its ring: that one, digits and letters."""

_PRESET, _LONGEST = len("1234"), 15
"""Characters of the PIN that is offered, and of the longest one."""


class Question:
    """The question over the normal screen: it waits until the screen is drawn, then is drawn pass by pass.

    Args:
        screen: Draws it.
        draw_bar: Draws the status bar.

    Attributes:
        sounded: Whether its sound was played.
        chosen: Whether it was answered, with a PIN or none.
    """

    def __init__(self, screen: ScreenRefresh, draw_bar: Callable[[], None]) -> None:
        self._screen, self._draw_bar = screen, draw_bar
        self.begin()

    def begin(self) -> None:
        """Begin to draw it."""
        self._parts = [*marks.QUESTION]
        self.sounded = self.chosen = self._has_bar = self._erased = False
        self._place, self._length, self._is_preset = _OK, _PRESET, True

    @property
    def waits(self) -> bool:
        """Whether it is shown and has no answer."""
        return not (self._parts or self.chosen)

    def press(self, key: int) -> None:
        """Follow a key: choose a character, enter or delete it, or end.

        The first exit deletes all of the PIN that is offered, and exit without a character ends.
        """
        if key in (Key.LEFT, Key.RIGHT):
            self._place = (self._place + (1 if key == Key.RIGHT else -1)) % _PLACES
            self._screen.mark(marks.CHARACTER)
        elif key == Key.ENTER and self._place != _OK:
            self._length, self._is_preset = min(self._length + 1, _LONGEST), False
        elif key == Key.EXIT and self._length:
            self._length, self._is_preset = 0 if self._is_preset else self._length - 1, False
        else:
            self.chosen = key in (Key.ENTER, Key.EXIT)
            return
        self._parts = [*marks.QUESTION[1:]] if self._place == _OK else [marks.QUESTION[1]]

    def go_on(self) -> bool:
        """Draw its next part, or erase it after the answer; return whether it ends now."""
        if not self._screen.pops_up:
            if not self._screen.drawing:
                self._screen.pop_up()
        elif not self._has_bar:
            self._has_bar = True
            self._draw_bar()
        elif self._parts:
            self._screen.mark(self._parts.pop(0))
        elif self.chosen and not self._erased:
            self._erased = True
            self._screen.mark(marks.ANSWERED)
            self._draw_bar()
        elif self.chosen and not self._screen.drawing:
            self._screen.show_normal()
            return True
        return False
