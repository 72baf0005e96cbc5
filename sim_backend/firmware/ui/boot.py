"""The start of a brick that has switched itself off. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from firmware_protocol.iomap import DisplayFlag, UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import STARTUP, SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.battery_warning import BatteryWarning
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import STARTING, UiState
from sim_backend.firmware.ui.status_bar import StatusBar

_PICTURES = 17
"""Number of the pictures of the logo."""
_SOUND_AT = 12
"""The picture at whose end the sound of the start begins."""
_AFTER_PICTURE_MS = 900
"""Time of the state after the pictures, if it is written, from the end of the present picture on."""


class Boot:
    """The states of a start, which are those of a power-on."""

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        battery: Battery,
        warning: BatteryWarning,
        screen: ScreenRefresh,
        status_bar: StatusBar,
        sound: SoundModule,
    ) -> None:
        self._clock, self._registers, self._battery, self._warning = clock, registers, battery, warning
        self._screen, self._status_bar, self._sound = screen, status_bar, sound
        self._pictures, self._loads, self._showed_empty = 0, False, False

    @property
    def finds_empty(self) -> bool:
        """Whether the battery is empty, which interrupts the logo, but not that after the empty battery."""
        return self._battery.empty and not self._showed_empty and self._registers.state == UiState.LOGO

    @property
    def shows_empty(self) -> bool:
        """Whether the empty battery or the warning was drawn, and state EMPTY follows in this pass."""
        return self._warning.given and self.finds_empty

    def end(self) -> None:
        """After the last state take requests and keys."""
        registers = self._registers
        if registers.state != UiState.WAITING or not (registers.starting or registers.left_start):
            return
        registers.clear(UiFlag.BUSY)
        registers.starting = registers.left_start = False

    def go_on(self) -> None:
        """Enter the next state."""
        registers, now_ms = self._registers, self._clock.now_ms
        if registers.is_on and registers.state in (UiState.START, UiState.EMPTY):
            self._show_logo(now_ms)
            return
        if registers.is_on and registers.state == UiState.LOGO and self._turns_picture(now_ms):
            return
        state, wait_ms = STARTING.get(registers.state, (UiState.WAITING, 1)) if registers.is_on else (UiState.START, 1)
        registers.state, registers.next_step_ms = int(state), now_ms + wait_ms
        if state == UiState.ENTRY:
            self._screen.mark(marks.ENTRY)
        elif state == UiState.WAITING:
            registers.flags = registers.flags & ~states.STATUS_WORK | int(UiFlag.ENABLE_STATUS)
            self._screen.mark(marks.MENU)
            self._status_bar.draw(everything=False)

    def skip_pictures(self) -> None:
        """Leave out the pictures to come, for a written state, which lasts longer by the rest of the present one."""
        self._registers.next_step_ms += _AFTER_PICTURE_MS

    def follow(self) -> None:
        """Show that the battery is empty instead of the logo, once: draw it, and in the next pass set its state."""
        if not (self.finds_empty and self._battery.was_empty(self._clock.now_ms)):
            return
        if not self._warning.given:
            self._warning.omit()
            self._screen.mark(marks.EMPTY)
            return
        registers, now_ms = self._registers, self._clock.now_ms
        registers.flags = registers.flags & ~states.STATUS_WORK | int(UiFlag.ENABLE_STATUS)
        self._status_bar.draw(everything=True)
        registers.state, registers.next_step_ms = int(UiState.EMPTY), now_ms + times.EMPTY_MS

    def _show_logo(self, now_ms: int) -> None:
        """Show the first picture of the logo; after that of the empty battery a requested file waits."""
        registers = self._registers
        self._showed_empty = registers.state == UiState.EMPTY
        requested = registers.flags & UiFlag.EXECUTE_FILE if self._showed_empty else 0
        registers.flags = int(UiFlag.BUSY) | requested
        self._screen.mark(marks.LOGO)
        self._pictures, self._loads = 1, False
        registers.state = int(UiState.LOGO)
        registers.next_step_ms = now_ms + times.LOGO_MS

    def _turns_picture(self, now_ms: int) -> bool:
        """Stop the refresh, and begin it again with the next picture when it has ended; False after the last one."""
        registers, screen = self._registers, self._screen
        if screen.flags & DisplayFlag.REFRESH:
            screen.end_refresh()
            registers.next_step_ms = now_ms + 1
        elif not screen.stopped:
            registers.next_step_ms = now_ms + 1
        elif self._pictures < _PICTURES and not self._loads:
            if self._pictures == _SOUND_AT:
                self._sound.play_own(STARTUP, registers.volume)
            self._loads, registers.next_step_ms = True, now_ms + times.PICTURE_LEAD_MS
            screen.mark(marks.PICTURE)
        else:
            screen.refresh()
            self._pictures, self._loads = self._pictures + 1, False
            registers.next_step_ms = now_ms + times.PICTURE_MS
        return self._pictures <= _PICTURES
