"""The states of a start, which are those of a power-on. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import STARTUP, SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import times
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.battery_warning import GIVEN, SHOWN_EMPTY, BatteryWarning
from sim_backend.firmware.ui.registers import PICTURES, UiRegisters
from sim_backend.firmware.ui.states import UiState

_SOUND_AT = 11
"""The picture, from 0 on, with which the sound of the start begins."""


class Boot:
    """The states START, EMPTY, LOGO and MELODY.

    Args:
        restart: Makes everything as at power-on.
    """

    def __init__(
        self,
        registers: UiRegisters,
        battery: Battery,
        warning: BatteryWarning,
        screen: ScreenRefresh,
        sound: SoundModule,
        restart: Callable[[], None],
    ) -> None:
        self._registers, self._battery, self._warning = registers, battery, warning
        self._screen, self._sound, self._restart = screen, sound, restart

    @property
    def due(self) -> bool:
        """Whether the next pass of the logo shows the empty battery."""
        given = self._warning.given
        return self._registers.state == UiState.LOGO and (given == GIVEN or (self._battery.empty and not given))

    def start(self) -> None:
        """Begin the start with the first picture of the logo."""
        self._restart()
        self._registers.starting, self._registers.flags = True, int(UiFlag.BUSY)
        self._begin_logo()

    def _begin_logo(self) -> None:
        registers = self._registers
        self._screen.mark(marks.LOGO)
        registers.timer.value, registers.step, registers.picture = -times.FIRST_PICTURE_PASSES, 0, 0
        registers.go_to(UiState.LOGO)

    def show_empty(self) -> None:
        """Show the empty battery for some time, and then the logo; a file that was requested still waits."""
        registers = self._registers
        left = times.EMPTY_PASSES - registers.timer.count()
        if left > 0:
            registers.rest(left)
            return
        self._warning.given = SHOWN_EMPTY
        registers.clear(UiFlag.ENABLE_STATUS)
        self._begin_logo()

    def show_logo(self) -> None:
        """Show each picture for some time, then stop the refresh, and begin it again with the next one.

        The empty battery comes instead, once: it is drawn, and in the next pass its state is set.
        """
        registers = self._registers
        if self._warning.given == GIVEN:
            registers.set(UiFlag.ENABLE_STATUS | UiFlag.UPDATE | UiFlag.REDRAW_STATUS)
            registers.timer.value = 0
            registers.go_to(UiState.EMPTY)
            return
        if self._battery.empty and not self._warning.given:
            self._warning.given = GIVEN
            self._screen.mark(marks.EMPTY)
        left = times.PICTURE_PASSES - registers.timer.count()
        if left > 0:
            registers.rest(left)
        else:
            self._turn_picture()

    def _turn_picture(self) -> None:
        registers, screen = self._registers, self._screen
        match registers.step:
            case 0:
                screen.end_refresh()
                registers.step = 1
            case 1 if screen.stopped:
                if registers.picture < PICTURES:
                    screen.mark(marks.PICTURE)
                    if registers.picture == _SOUND_AT:
                        self._sound.play_own(STARTUP, registers.volume)
                    registers.picture += 1
                else:
                    screen.refresh()
                    registers.go_to(UiState.MELODY)
                registers.step = 2
            case 1:
                pass
            case _ if not screen.update_mask & marks.PICTURE.update:
                screen.refresh()
                registers.timer.value = registers.step = 0

    def wait(self) -> None:
        """Wait after the pictures, and erase them."""
        left = times.MELODY_PASSES - self._registers.timer.count()
        if left > 0:
            self._registers.rest(left)
            return
        self._screen.mark(marks.ENTRY)
        self._registers.go_to(UiState.ENTRY)
