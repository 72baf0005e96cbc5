"""The user interface's warning of a low battery. Source: docs/firmware.md section 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState

GIVEN, SHOWN_EMPTY = 1, 2


class BatteryWarning:
    """The warning, once after each start, until a key is pressed.

    It interrupts any state in which the user interface is not busy, also a file that has the screen; after it that
    continues where it was, as if no time had passed.

    Attributes:
        given: 0, `GIVEN` when the battery was reported to be low or empty since the last start, or `SHOWN_EMPTY`.
    """

    def __init__(
        self, clock: Clock, registers: UiRegisters, battery: Battery, keys: KeyInput, screen: ScreenRefresh
    ) -> None:
        self._clock, self._registers, self._battery, self._keys = clock, registers, battery, keys
        self._screen = screen
        self.given, self._returns_to = 0, int(UiState.START)

    @property
    def due(self) -> bool:
        """Whether the warning comes as soon as the screen is drawn."""
        return self._battery.low and not (self.given or self._registers.flags & UiFlag.BUSY)

    def follow(self) -> None:
        """Show the warning if it is due."""
        registers = self._registers
        if self.due and not self._screen.drawing:
            self.given, self._returns_to = GIVEN, registers.state
            registers.set(UiFlag.BUSY | UiFlag.REDRAW_STATUS)
            registers.go_to(UiState.LOW_BATTERY)
            self._screen.mark(marks.WARNING)
            self._screen.pop_up()

    def wait(self) -> None:
        """Close the warning by a key, which is read when nothing of the screen is left to draw."""
        if self._screen.drawing:
            return
        if self._keys.read():
            self._registers.clear(UiFlag.BUSY)
            self._screen.rest(self._clock.now_ms)
            self._registers.go_to(self._returns_to)
        else:
            self._registers.rest()
