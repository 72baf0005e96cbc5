"""The states of the menus: a key, the page that it leads to, and waiting for the next key.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.page import CurrentPage
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import KEY_STATES, Step, UiState


class MenuStates:
    """The states ENTRY to EXIT, which lead to each other, and through those of a key that are left."""

    def __init__(self, registers: UiRegisters, keys: KeyInput, menu: Menu, current: CurrentPage) -> None:
        self._registers, self._keys, self._menu = registers, keys, menu
        self._current, self._states = current, current.states

    def enter(self) -> None:
        """Go to the first item of the main menu."""
        self._menu.reset()
        self._registers.go_to(UiState.MENU)

    def prepare(self) -> None:
        """Begin to draw the page."""
        if not self._states.go_on():
            self._menu.prepare()
            self._registers.step = Step.BEGUN
            self._registers.go_to(UiState.DRAWING)

    def draw(self) -> None:
        """Show a menu or a page, pass by pass; when there is nothing left of it, take keys."""
        current, states = self._current, self._states
        had_states = states.shown
        if states.go_on():
            return
        if not (had_states or current.exists):
            self._menu.draw()
        if not current.exists:
            self._registers.go_to(UiState.WAITING)
        elif had_states and not current.begins:
            self._registers.wake_in(1)
        else:
            current.run()
            states.follow()

    def follow(self, key: int) -> None:
        """Follow a key, unless it only leads to the next state of another one, or to a page that stays."""
        if not self._states.go_on():
            self._registers.go_to(UiState.MENU)
            if not self._current.stays:
                self._menu.press(key)

    def wait(self) -> None:
        """Wait for a key; this is also the end of a start."""
        registers = self._registers
        registers.may_switch_off = True
        if registers.starting:
            registers.clear(UiFlag.BUSY)
            registers.starting = False
        key = self._keys.read()
        if key in KEY_STATES and not (key == Key.EXIT and self._menu.ignores_exit):
            registers.go_to(KEY_STATES[key])
