"""The user interface's question whether to accept a connection, which the radio requests.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.states import KEY_STATES
from sim_backend.firmware.ui.text_entry import TextEntry

_PIN = "1234"
"""The one that is offered."""


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
        self._entry, self._parts = TextEntry(_PIN), [*marks.TEXT]
        self.sounded = self.chosen = self._pops_up = self._has_bar = self._erased = False

    def redraw(self) -> None:
        """Draw the text once more."""
        self._parts = [marks.TEXT[0], *self._entry.drawn]

    @property
    def waits(self) -> bool:
        """Whether it is shown and has no answer."""
        return not (self._parts or self.chosen)

    def press(self, key: int) -> None:
        """Follow a key, if it is one."""
        self.chosen = self._entry.press(key)
        if key in KEY_STATES and not self.chosen:
            if key in (Key.LEFT, Key.RIGHT):
                self._screen.mark(marks.CHARACTER)
            self._parts = [*self._entry.drawn]

    def go_on(self) -> bool:
        """Draw its next part, or erase it after the answer; return whether it ends now."""
        if not self._pops_up:
            if not self._screen.drawing:
                self._pops_up = True
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
