"""What the menus show until a key is pressed: that a port has a value already, and the version.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.module import Clock
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.page import Page
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import NOTHING
from sim_backend.firmware.ui.states import UiState

_REFUSED_PASSES = 1500
"""Time after which the message that a port has a value already ends, if no key is pressed."""


class MenuMessage:
    """The messages that any key closes.

    Args:
        leave: Called to end the page.

    Attributes:
        refused: The message that a port has a value already.
        version: The version.
        shown: Count of the passes of the first one.
    """

    def __init__(
        self, clock: Clock, registers: UiRegisters, keys: KeyInput, states: KeyStates, leave: Callable[[], None]
    ) -> None:
        self._registers, self._keys, self._states, self._leave = registers, keys, states, leave
        self.refused = Page(self._begin_refused, self._go_on_refused)
        self.version = Page(self._begin_version, self._go_on_version)
        self.shown = PassCounter(clock)
        self._was_left = self._goes_on = False

    def _begin_refused(self) -> None:
        self.shown.restart()
        self._registers.wake_in(_REFUSED_PASSES)

    def _go_on_refused(self) -> None:
        left = _REFUSED_PASSES - self.shown.count()
        if left > 0 and not self._keys.read():
            self._registers.wake_in(left)
            return
        self._leave()
        self._states.draw(marks.REFUSED)
        self._states.begin(UiState.MENU, UiState.DRAWING)
        self._states.draw_last(marks.PAGE)

    def show_version(self) -> None:
        """Show the version, a pass later if it was shown before, and without drawing it if no key has ended it."""
        self._states.draw_last(*[NOTHING] * self._was_left, NOTHING if self._goes_on else marks.VERSION)

    def _begin_version(self) -> None:
        self._goes_on = True

    def _go_on_version(self) -> None:
        """Wait for a key; then draw the page again, slowly the first time."""
        if self._keys.read():
            self._leave()
            self._states.begin(UiState.DRAWING)
            self._states.draw_last(*(drawing.VERSION_LEFT_AGAIN if self._was_left else drawing.VERSION_LEFT))
            self._was_left, self._goes_on = True, False
