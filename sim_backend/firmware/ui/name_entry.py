"""The page of the menus where a program made on the brick gets a name. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.page import Page
from sim_backend.firmware.ui.program_steps import ProgramSteps
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.text_entry import TextEntry

_OFFERED = "Untitled"


class NameEntry:
    """Asks for a name, and saves the program.

    Args:
        registers: Those of the user interface.
        keys: The keys.
        program: The program.
        states: Shows it.
        leave: Called when the page has ended; whether its place is left, too: the program was saved, or has no name.

    Attributes:
        page: The page.
    """

    def __init__(
        self,
        registers: UiRegisters,
        keys: KeyInput,
        program: ProgramSteps,
        states: KeyStates,
        leave: Callable[[bool], None],
    ) -> None:
        self._registers, self._keys, self._program, self._states, self._leave = registers, keys, program, states, leave
        self.page = Page(self._draw_rest, self._go_on, stays=True, interrupt=self._interrupt)
        self._entry, self._rest = TextEntry(_OFFERED), list[Marks]()

    def begin(self) -> None:
        """Ask for a name after the passes of a key."""
        self._entry = TextEntry(_OFFERED)
        self._states.draw_last(NOTHING, *marks.TEXT)

    def _interrupt(self) -> None:
        """Keep what is left to draw: another state was written."""
        if self._states.shown:
            self._rest = [*self._states.undrawn]

    def _draw_rest(self) -> None:
        """Continue after other states, where it was."""
        self._registers.wake_in(1)
        if self._rest:
            self._states.begin(UiState.DRAWING)
            self._states.draw_last(*self._rest)
            self._rest.clear()

    def _go_on(self) -> None:
        """Follow a key: change the name, save the program, or leave the page if there is no name."""
        states, entry, key = self._states, self._entry, self._keys.read()
        if not key:
            return
        states.begin(UiState.DRAWING)
        if not entry.press(key):
            states.draw(marks.CHARACTER if key in (Key.LEFT, Key.RIGHT) else NOTHING)
            states.draw_last(*entry.drawn)
            return
        self._leave(False)
        if entry.text:
            states.draw_last(marks.ANSWERED, NOTHING, actions={1: lambda: self._save(entry.text)})
        else:
            states.draw_last(marks.ANSWERED, NOTHING)
            self._end()

    def _save(self, name: str) -> None:
        saved, states = self._program.save(name), self._states
        states.add(UiState.DRAWING)
        states.draw_last(*(drawing.SAVED if saved else drawing.NOT_SAVED))
        if saved:
            self._end()

    def _end(self) -> None:
        self._states.add(UiState.MENU, UiState.DRAWING)
        self._states.draw_last(marks.MENU)
        self._leave(True)
