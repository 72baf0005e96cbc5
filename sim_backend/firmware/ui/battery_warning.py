"""The user interface's warning of a low battery. Source: docs/firmware.md section 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.status_bar import StatusBar


class BatteryWarning:
    """The warning, once after each start, until a key is pressed.

    Attributes:
        given: Whether the battery was reported to be low, or empty, since the last start.
        answered: Whether a button was pressed that closes the warning once it takes keys.
        returns_to: State after the warning.
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
        self.given = self.answered = False
        self.returns_to = UiState.START
        self._since_ms = 0

    @property
    def due(self) -> bool:
        """Whether the warning comes as soon as the screen is drawn."""
        low = self._battery.low and not self.given
        return low and self._registers.state in states.MENU_SHOWN and not self._registers.from_menu

    @property
    def shown(self) -> bool:
        """Whether the warning is shown."""
        return self._registers.state == UiState.LOW_BATTERY

    @property
    def is_new(self) -> bool:
        """Whether the warning is shown, but no key counts yet."""
        return self.shown and self._clock.now_ms < self._since_ms + times.WARNING_DEAF_MS

    def follow(self) -> None:
        """Show the warning if it is due."""
        if not self.due or self._screen.drawing:
            return
        registers = self._registers
        self.given, self.returns_to = True, UiState.WAITING if registers.is_on else UiState.DRAWING
        registers.set(UiFlag.BUSY)
        registers.state, registers.next_step_ms = int(UiState.LOW_BATTERY), NEVER
        self._since_ms = self._clock.now_ms
        self._screen.mark(marks.WARNING)
        if registers.flags & UiFlag.ENABLE_STATUS:
            self._status_bar.draw(everything=False)
        else:
            registers.set(UiFlag.REDRAW_STATUS)
        self._screen.pop_up()

    def allow(self) -> None:
        """Warn again, after a start."""
        self.given = False

    def omit(self) -> None:
        """Give no warning in this start: the battery was shown as empty."""
        self.given = True

    def press(self) -> None:
        """Note a button that closes the warning."""
        self.answered |= self.shown

    def takes_button(self) -> bool:
        """Return whether a button closes it: one pressed since then, or left or right when it counts again."""
        if not self.shown or self.is_new:
            return False
        key = self._keys.read_button()
        return self.answered or (key is not None and not self._keys.disabled(key))
