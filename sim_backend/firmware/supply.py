"""The user interface's supervision of battery and power. Source: docs/firmware.md section 8."""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware import ui_states as states
from sim_backend.firmware import ui_times as times
from sim_backend.firmware.battery import Battery
from sim_backend.firmware.io_control import POWER_DOWN, IoControl
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sleep_timer import SleepTimer
from sim_backend.firmware.ui_states import Programs, UiState


class Supply(SleepTimer):
    """The warning of a low battery, and switching off.

    Attributes:
        battery: The supply.
        programs: The command module; set by the brick.
        flags: See `firmware_protocol.iomap.UiFlag`.
        state: See `UiState`.
        force_off: Nonzero to switch the brick off.
    """

    programs: Programs

    def __init__(self, clock: Clock, io_control: IoControl, screen: ScreenRefresh) -> None:
        super().__init__(clock)
        self._io_control, self._screen = io_control, screen
        self.battery, self.force_off = Battery(), 0
        self.flags, self.state = int(UiFlag.ENABLE_STATUS), int(UiState.WAITING)
        self._next_step_ms = self._off_ms = NEVER
        self._warned = self._from_menu = False
        self._warned_in = UiState.START

    def watch_supply(self) -> None:
        """Warn of a low battery once; switch off when the sleep timer has expired, and the display before the power."""
        now_ms = self._clock.now_ms
        self._warned = self._warned and self.battery.low
        if self._warns and self.battery.since_sample_ms(now_ms) >= times.WARNING_MS:
            self._warned, self._warned_in = True, UiState.WAITING
            self.flags |= int(UiFlag.BUSY)
            self.state, self._next_step_ms = int(UiState.LOW_BATTERY), NEVER
        if self.expired and self._off_ms == NEVER:
            self.force_off = 1
        if self.force_off and self._off_ms == NEVER:
            self._off_ms, self.force_off = now_ms, 0
            if self.state in states.IN_MENU:
                self.state, self._next_step_ms = int(UiState.DRAWING), NEVER
            if self.programs.active:
                self.programs.stop()
        if now_ms >= self._off_ms + times.DISPLAY_OFF_MS and self.state != UiState.LOW_BATTERY:
            self._io_control.display_on = self._screen.on = False
        if now_ms >= self._off_ms + times.POWER_OFF_MS:
            self._io_control.power_word = POWER_DOWN

    @property
    def _warns(self) -> bool:
        return self.battery.low and not self._warned and self.state in states.IN_MENU and not self._from_menu
