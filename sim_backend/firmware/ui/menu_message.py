"""What the menus show until a key is pressed: that a port has a value already, and the version.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from sim_backend.firmware.module import NEVER
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.screen_marks import NOTHING
from sim_backend.firmware.ui.states import UiState

_REFUSED_MS = 1500
"""Time after which the message that a port has a value already ends, if no key is pressed."""


class MenuMessage:
    """The message that any key closes, if one is shown.

    Args:
        logs: Tells whether a port was refused.
        states: Shows the end of the message.

    Attributes:
        has_version: Whether it is, or will be, the version.
    """

    def __init__(self, logs: LogMenu, states: KeyStates) -> None:
        self._logs, self._states = logs, states
        self.has_version = self._was_left = self._goes_on = False

    @property
    def shown(self) -> bool:
        """Whether it is shown."""
        return (self._logs.refuses or self.has_version) and not self._states.shown

    @property
    def lasts_ms(self) -> int:
        """How long it is shown without a key."""
        return NEVER if self.has_version else _REFUSED_MS

    def drop(self) -> None:
        """Show none; the version still waits for its key."""
        self._goes_on = self._goes_on or (self.has_version and self.shown)
        self.has_version = self._logs.refuses = False

    def show_version(self) -> None:
        """Show the version, a pass later if it was shown before, and without drawing it if no key has ended it."""
        self.has_version = True
        self._states.draw_last(*[NOTHING] * self._was_left, NOTHING if self._goes_on else marks.VERSION)

    def close(self) -> None:
        """End it, and draw the page again, after the version slowly the first time."""
        if self.has_version:
            self._states.begin(UiState.DRAWING)
            self._states.draw_last(*(drawing.VERSION_LEFT_AGAIN if self._was_left else drawing.VERSION_LEFT))
            self._was_left, self._goes_on = True, False
        else:
            self._states.begin(UiState.MENU, UiState.DRAWING, drawn=marks.REFUSED)
            self._states.draw_last(marks.PAGE)
        self.has_version = self._logs.refuses = False
