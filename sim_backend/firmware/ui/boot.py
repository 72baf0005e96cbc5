"""The states of a start, which are those of a power-on. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import STARTUP, SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.battery import Battery
from sim_backend.firmware.ui.battery_warning import BatteryWarning
from sim_backend.firmware.ui.registers import PICTURES, UiRegisters
from sim_backend.firmware.ui.states import Step, UiState
from sim_backend.firmware.ui.status_bar import StatusBar

_SOUND_AT = 12
"""The picture at whose end the sound of the start begins."""


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
        status_bar: StatusBar,
        sound: SoundModule,
        restart: Callable[[], None],
    ) -> None:
        self._registers, self._battery, self._warning = registers, battery, warning
        self._screen, self._status_bar, self._sound, self._restart = screen, status_bar, sound, restart
        self._showed_empty = False

    @property
    def finds_empty(self) -> bool:
        """Whether the battery is empty, which interrupts the logo, but not that after the empty battery."""
        return self._battery.empty and not self._showed_empty and self._registers.state == UiState.LOGO

    def start(self) -> None:
        """Begin the start with the first picture of the logo."""
        self._restart()
        self._showed_empty = False
        self._registers.starting, self._registers.flags = True, int(UiFlag.BUSY)
        self._registers.picture = 1
        self._begin_logo()

    def _begin_logo(self) -> None:
        registers = self._registers
        self._screen.mark(marks.LOGO)
        registers.timer.value, registers.step = -times.FIRST_PICTURE_PASSES, Step.BEGUN
        registers.go_to(UiState.LOGO)

    def show_empty(self) -> None:
        """Show the empty battery for some time, and then the logo; a file that was requested still waits."""
        registers = self._registers
        left = times.EMPTY_PASSES - registers.timer.count()
        if left > 0:
            registers.wake_in(left)
            return
        self._showed_empty = True
        self._warning.omit()
        registers.may_switch_off = True
        registers.clear(UiFlag.ENABLE_STATUS)
        self._begin_logo()

    def show_logo(self) -> None:
        """Show each picture for some time, then stop the refresh, and begin it again with the next one.

        The empty battery comes instead, once: it is drawn, and in the next pass its state is set.
        """
        registers = self._registers
        left = times.PICTURE_PASSES - registers.timer.count()
        if self.finds_empty and not self._warning.given:
            self._warning.omit()
            self._screen.mark(marks.EMPTY)
            registers.wake_in(1)
        elif self.finds_empty:
            registers.flags = registers.flags & ~states.STATUS_WORK | int(UiFlag.ENABLE_STATUS)
            self._status_bar.draw(everything=True)
            registers.timer.value = 0
            registers.go_to(UiState.EMPTY)
        elif left > 0:
            registers.wake_in(left)
        else:
            registers.wake_in(1)
            self._turn_picture()

    def _turn_picture(self) -> None:
        registers, screen = self._registers, self._screen
        match registers.step:
            case Step.BEGUN:
                screen.end_refresh()
                registers.step = Step.TONE
            case Step.TONE if screen.stopped and registers.picture == PICTURES:
                screen.refresh()
                registers.step = Step.BEGUN
                registers.go_to(UiState.MELODY)
            case Step.TONE if screen.stopped:
                if registers.picture == _SOUND_AT:
                    self._sound.play_own(STARTUP, registers.volume)
                screen.mark(marks.PICTURE)
                registers.step = Step.LOADED
            case Step.TONE:
                pass
            case Step.LOADED:
                registers.step = Step.DRAWING
            case _:
                screen.refresh()
                registers.picture = min(registers.picture + 1, PICTURES)
                registers.timer.value, registers.step = 0, Step.BEGUN

    def wait(self) -> None:
        """Wait after the pictures, and erase them."""
        left = times.MELODY_PASSES - self._registers.timer.count()
        if left > 0:
            self._registers.wake_in(left)
            return
        self._screen.mark(marks.ENTRY)
        self._registers.go_to(UiState.ENTRY)
