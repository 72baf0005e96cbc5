"""The menu pages on which a program of five steps is made on the brick. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from functools import partial

from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.name_entry import NameEntry
from sim_backend.firmware.ui.program_steps import LEAVE, PROGRAM, RUN, SAVE, ProgramSteps
from sim_backend.firmware.ui.states import Place, UiState


class MenuSteps:
    """Opens and leaves the steps and the page after them, with the states of a key that show it.

    Args:
        program: The program.
        states: Shows it.
        naming: The page where the program gets a name.
    """

    def __init__(self, program: ProgramSteps, states: KeyStates, naming: NameEntry) -> None:
        self._program, self._states, self._naming = program, states, naming

    def has(self, menu: Place) -> bool:
        """Return whether a menu is one of the steps, or the page after them."""
        return self._program.is_step(menu) or self._program.is_run(menu)

    def open(self, menu: Place) -> None:
        """Open a step, or the page after them."""
        self._states.act(partial(self._program.enter, menu))
        self._states.draw_last(*self._program.drawn(menu))

    def leave(self, place: Place) -> None:
        """Follow exit from a place in a step, or in the page after them, of which the second item keeps the step."""
        program, states, menu = self._program, self._states, place[:-1]
        if not self.has(menu) or (program.is_run(menu) and place[-1] == LEAVE):
            return
        states.act(partial(program.leave, place))
        if program.is_step(menu[:-1]):
            states.draw_last(program.drawn_back, marks.PAGE)
        elif program.goes_on:
            states.draw_last(program.drawn_back, marks.MENU, marks.TYPES)
        else:
            states.draw_last(marks.STEP)
            states.add(UiState.MENU, UiState.DRAWING)
            states.draw_last(marks.MENU, marks.TYPES)

    def follows(self, place: Place) -> bool:
        """Return whether a place is below the last step: in the page there, or where a name was asked for."""
        return self._program.is_run(place[:-1]) or self._program.is_run(place[:-2])

    def names(self, place: Place) -> bool:
        """Return whether enter asks for a name in a place."""
        return self._program.is_run(place[:-1]) and place[-1] == SAVE

    def enter(self, place: Place) -> list[int]:
        """Follow enter in such a place, and return where it leads; the page of a name has no items."""
        item = place[-1] if self._program.is_run(place[:-1]) else None
        if item == LEAVE:
            return [PROGRAM]
        if item == SAVE:
            self._naming.begin()
            return [*place, 0]
        if item == RUN:
            self._run()
        return [*place]

    def _run(self) -> None:
        """Run the program, for which a file is missing."""
        self._states.draw_last(*marks.NOT_RUN, actions=self._program.actions)
        for number, held in self._program.holds.items():
            self._states.hold(number - len(marks.NOT_RUN), held)
