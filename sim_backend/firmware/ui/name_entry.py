"""The page of the menus where a program made on the brick gets a name. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.program_steps import ProgramSteps
from sim_backend.firmware.ui.screen_marks import NOTHING
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.text_entry import TextEntry

_OFFERED = "Untitled"


class NameEntry:
    """Asks for a name, and saves the program.

    Args:
        program: The program.
        states: Shows it.
        leave: Called when the page is left.
    """

    def __init__(self, program: ProgramSteps, states: KeyStates, leave: Callable[[], None]) -> None:
        self._program, self._states, self._leave = program, states, leave
        self._entry: TextEntry | None = None

    @property
    def active(self) -> bool:
        """Whether a name is asked for."""
        return self._entry is not None

    @property
    def shown(self) -> bool:
        """Whether it waits for a key."""
        return self.active and not self._states.shown

    def drop(self) -> None:
        """Show none."""
        self._entry = None

    def begin(self) -> None:
        """Ask for a name after the passes of a key."""
        self._entry = TextEntry(_OFFERED)
        self._states.draw_last(NOTHING, *marks.TEXT)

    def press(self, key: int) -> None:
        """Follow a key: change the name, save the program, or leave the page if there is no name."""
        states, entry = self._states, self._entry
        if entry is None:
            return
        if not entry.press(key):
            states.begin(UiState.DRAWING, drawn=marks.CHARACTER if key in (Key.LEFT, Key.RIGHT) else NOTHING)
            states.draw_last(*entry.drawn)
            return
        states.begin(UiState.DRAWING)
        self.drop()
        if entry.text:
            states.draw_last(marks.ANSWERED, NOTHING, actions={1: lambda: self._save(entry.text)})
        else:
            states.draw_last(marks.ANSWERED, NOTHING)
            self._end()

    def go_on(self, *states: UiState) -> None:
        """Continue after other states, where it was."""
        parts = self._states.undrawn
        self._states.begin(*states, UiState.DRAWING)
        self._states.draw_last(NOTHING, *parts)

    def _save(self, name: str) -> None:
        saved, states = self._program.save(name), self._states
        states.add(UiState.DRAWING)
        states.draw_last(*(drawing.SAVED if saved else drawing.NOT_SAVED))
        if saved:
            self._end()

    def _end(self) -> None:
        self._states.add(UiState.MENU, UiState.DRAWING)
        self._states.draw_last(marks.MENU)
        self._leave()
