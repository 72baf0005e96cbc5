"""The states that follow a key of the menus, and what they draw and do. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.states import UiState

Action = Callable[[], object]


class Pass(NamedTuple):
    """A pass of the user interface.

    Attributes:
        state: Its state.
        drawn: What it draws at its end.
        action: What it does then, if anything.
        held: Whether it lasts on, if it can.
    """

    state: UiState
    drawn: Marks = NOTHING
    action: Action | None = None
    held: Callable[[], bool] | None = None


class KeyStates:
    """The present state and those to come, one for each pass.

    Args:
        registers: Holds the flags.
        screen: Draws.

    Attributes:
        left: The passes that are left, the present one first.
        page: Those of the page that is drawn, from its beginning on, until it is drawn or another key counts.
    """

    def __init__(self, registers: UiRegisters, screen: ScreenRefresh) -> None:
        self._registers, self._screen = registers, screen
        self.left, self.page = list[Pass](), list[Pass]()

    @property
    def shown(self) -> bool:
        """Whether the states of a key are shown."""
        return bool(self.left)

    @property
    def draws(self) -> bool:
        """Whether the last pass draws."""
        return any(self.left[-1].drawn)

    @property
    def undrawn(self) -> Sequence[Marks]:
        """What is left to draw."""
        return [each.drawn for each in self.left if any(each.drawn)]

    def drop(self) -> None:
        """Drop the states to come, and what they draw."""
        self.left = []

    def begin(self, *states: UiState) -> None:
        """Show states from the next pass on."""
        self.left, self.page = [], []
        self.add(*states)

    def keep_page(self) -> None:
        """Begin a page with the passes that are left: state MENU draws it again until it is drawn."""
        self.page = [*self.left]

    def begin_page(self) -> bool:
        """Draw the page that was begun last from its beginning; return whether there is one."""
        self.page = [*self.left] or self.page
        self.left = [*self.page]
        return self.shown

    def add(self, *states: UiState) -> None:
        """Show more states."""
        self.left += map(Pass, states)

    def show(self, state: UiState) -> None:
        """Add the states of a key."""
        self.add(state, UiState.MENU, UiState.DRAWING)

    def act(self, action: Action) -> None:
        """Do something at the end of the first pass of state DRAWING that is left."""
        at = [each.state for each in self.left].index(UiState.DRAWING)
        self.left[at] = self.left[at]._replace(action=action)

    def act_last(self, action: Action) -> None:
        """Do something at the end of the last pass."""
        self.left[-1] = self.left[-1]._replace(action=action)

    def draw_last(self, *drawn: Marks, actions: Mapping[int, Action] | None = None) -> None:
        """Show the last state, DRAWING, for a pass for each of the marks, which are made at the end of the pass.

        Args:
            drawn: The marks.
            actions: What the ends of some of these passes do, by the number of the pass, from 0 on.
        """
        last = self.left.pop()
        acts = {0: last.action, **(actions or {})}
        self.left += [Pass(last.state, each, acts.get(at)) for at, each in enumerate(drawn)]

    def hold(self, at: int, held: Callable[[], bool]) -> None:
        """Let a pass, by its number among those that are left, last as long as something holds it."""
        self.left[at] = self.left[at]._replace(held=held)

    def insert(self, action: Action) -> None:
        """Put a pass of state DRAWING for an action in front of the next one."""
        self.left.insert(0, Pass(UiState.DRAWING, action=action))

    def draw_next(self, drawn: Marks) -> None:
        """Change what the next pass draws."""
        self.left[0] = self.left[0]._replace(drawn=drawn)

    def draw(self, drawn: Marks) -> None:
        """Draw. A page shows the status bar, and draws its icons that have changed."""
        self._screen.mark(drawn)
        if drawn.shows_bar:
            self._registers.set(UiFlag.ENABLE_STATUS | UiFlag.UPDATE)
        if drawn.draws_bar:
            self._registers.set(UiFlag.REDRAW_STATUS)

    def go_on(self) -> bool:
        """End the present pass, if it is one of these: draw, and act; return whether a state follows.

        The pass lasts on if it is held, or its drawing waits until others are done.
        """
        if not self.left or self.left[0].state != self._registers.state:
            return False
        present = self.left[0]
        if not ((present.drawn.waits and self._screen.drawing) or (present.held and present.held())):
            del self.left[0]
            self.draw(present.drawn)
            if present.action:
                present.action()
        return self.follow()

    def follow(self) -> bool:
        """Go to the present state in the next pass; return whether there is one."""
        if not self.left:
            self.page = []
        elif self._registers.state == UiState.MENU:
            self.keep_page()
        if self.left:
            self._registers.go_to(self.left[0].state)
        return self.shown
