"""The user interface's warning of a low battery. Source: docs/firmware.md section 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.status_bar import StatusBar


class BatteryWarning:
    """The warning, once after each start, until a key is pressed.

    It interrupts any state in which the user interface is not busy, also a file that has the screen; after it that
    continues where it was, as if no time had passed.

    Attributes:
        given: Whether the battery was reported to be low, or empty, since the last start.
        returns_to: State after a warning that the map shows: that before the last real one.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        battery: Battery,
        keys: KeyInput,
        screen: ScreenRefresh,
        status_bar: StatusBar,
    ) -> None:
        self._clock, self._registers, self._battery, self._keys = clock, registers, battery, keys
        self._screen, self._status_bar = screen, status_bar
        self.given = False
        self.returns_to = int(UiState.START)
        self._since_ms, self._next_step_ms, self._from_menu, self._interrupts = 0, NEVER, False, False

    @property
    def due(self) -> bool:
        """Whether the warning comes as soon as the screen is drawn."""
        return self._battery.low and not (self.given or self._registers.flags & UiFlag.BUSY)

    @property
    def shown(self) -> bool:
        """Whether the warning is shown."""
        return self._registers.state == UiState.LOW_BATTERY

    def follow(self) -> None:
        """Show the warning if it is due."""
        if not self.due or self._screen.drawing or not self._battery.was_low(self._clock.now_ms):
            return
        registers = self._registers
        self.given, self.returns_to, self._since_ms = True, registers.state, self._clock.now_ms
        self._next_step_ms, self._from_menu = registers.next_step_ms, registers.from_menu
        registers.set(UiFlag.BUSY)
        registers.state, registers.next_step_ms, registers.from_menu = int(UiState.LOW_BATTERY), NEVER, False
        self._interrupts = True
        self._screen.mark(marks.WARNING)
        registers.set(UiFlag.REDRAW_STATUS)
        self._status_bar.follow()
        self._screen.pop_up()

    def takes_key(self) -> bool:
        """Return whether a key closes it: it reads keys when nothing of the screen is left to draw."""
        return self.shown and not self._screen.drawing and bool(self._keys.read())

    def end(self) -> bool:
        """Continue what a real warning has interrupted, with the next pass; return whether there was one."""
        registers, interrupts, self._interrupts = self._registers, self._interrupts, False
        if interrupts:
            registers.state, registers.from_menu = self.returns_to, self._from_menu
            registers.next_step_ms = self._next_step_ms
            if self._next_step_ms != NEVER:
                registers.next_step_ms += self.lasts_ms
        return interrupts

    @property
    def lasts_ms(self) -> int:
        """How long the last warning has been shown."""
        return self._clock.now_ms - self._since_ms

    def forget(self) -> None:
        """Continue nothing after the warning: another state was written to the map."""
        self._interrupts = False

    def allow(self) -> None:
        """Warn again, after a start."""
        self.given = False

    def omit(self) -> None:
        """Give no warning in this start: the battery was shown as empty."""
        self.given = True
