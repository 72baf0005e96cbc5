"""The states that a key of the menus brings, and what they draw. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.states import UiState


def wait() -> None:
    """Do nothing at the end of a pass."""


class KeyStates:
    """The present state and those to come, one for each pass.

    Args:
        registers: Has the flags.
        screen: Draws.

    Attributes:
        shown: Whether the states of a key are shown.
        left: The states that are left, each with what it draws at the end of its pass.
        state: The present one, if any.
        actions: What the ends of the first passes of state DRAWING do.
    """

    def __init__(self, registers: UiRegisters, screen: ScreenRefresh) -> None:
        self._registers, self._screen = registers, screen
        self.drop()

    def drop(self) -> None:
        """Drop the states to come, and what they draw."""
        self.shown, self.left = False, list[tuple[UiState, Marks]]()
        self.state: UiState | None = None
        self._drawn = NOTHING
        self.actions: list[Callable[[], object]] = []

    def begin(self, *states: UiState, drawn: Marks = NOTHING) -> None:
        """Show states after the present one, which draws `drawn`."""
        self.shown, self._drawn, self.left, self.actions = True, drawn, [], []
        self.add(*states)

    def add(self, *states: UiState) -> None:
        """Show more states."""
        self.left += [(state, NOTHING) for state in states]

    def show(self, state: UiState) -> None:
        """Add the states of a key."""
        self.add(state, UiState.MENU, UiState.DRAWING)

    def draw_last(self, *drawn: Marks, actions: Sequence[Callable[[], object]] = ()) -> None:
        """Show the last state, DRAWING, for a pass for each of the marks, which are made at the end of the pass.

        Args:
            drawn: The marks.
            actions: What the ends of the first of these passes do.
        """
        if actions:
            before = sum(state == UiState.DRAWING for state, _ in self.left[:-1])
            self.actions += [*[wait] * (before - len(self.actions)), *actions]
        self.left[-1:] = [(self.left[-1][0], each) for each in drawn]

    def insert(self, drawn: Marks, actions: Sequence[Callable[[], object]]) -> None:
        """Put a pass for each of some actions in front of the next state, which is DRAWING and gets other marks."""
        self.left[:1] = [*[(UiState.DRAWING, NOTHING)] * len(actions), (UiState.DRAWING, drawn)]
        self.actions[:0] = actions

    def next(self) -> UiState | None:
        """Return the next state; the drawing of the one before is shown. A message waits until others are done."""
        if self._drawn in marks.REPORT and self._screen.drawing:
            return self.state
        self.finish()
        self.shown = bool(self.left)
        self.state, self._drawn = self.left.pop(0) if self.left else (None, NOTHING)
        return self.state

    def finish(self) -> None:
        """Do what the pass of the current state does at its end: draw, and act.

        A page shows the status bar, and draws its icons that have changed.
        """
        self._screen.mark(self._drawn)
        if self._drawn not in (NOTHING, marks.ENTRY):
            self._registers.set(UiFlag.ENABLE_STATUS)
        if self._drawn.update & marks.ICONS:
            self._registers.set(UiFlag.UPDATE)
        if self.state == UiState.DRAWING and self.actions:
            self.actions.pop(0)()
