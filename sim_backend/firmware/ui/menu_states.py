"""The states of the menus: a key, the page that it leads to, and waiting for the next key.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu import Menu
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import KEY_STATES, Step, UiState


class MenuStates:
    """The states ENTRY to EXIT."""

    def __init__(self, registers: UiRegisters, keys: KeyInput, menu: Menu) -> None:
        self._registers, self._keys, self._menu = registers, keys, menu

    def enter(self) -> None:
        """Go to the first item of the main menu."""
        self._menu.reset()
        self._registers.go_to(UiState.MENU)

    def prepare(self) -> None:
        """Begin to draw the page."""
        if not self._menu.go_on():
            self._menu.prepare()
            self._registers.step = Step.BEGUN
            self._registers.go_to(UiState.DRAWING)

    def draw(self) -> None:
        """Show the page, pass by pass; when there is nothing left of it, take keys."""
        self._menu.draw()

    def follow(self, key: int) -> None:
        """Follow a key, unless it only leads to the next state of another one, or to a page that stays."""
        if not self._menu.go_on():
            self._registers.go_to(UiState.MENU)
            if not self._menu.keeps_page:
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
