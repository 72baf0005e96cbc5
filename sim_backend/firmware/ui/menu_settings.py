"""The settings that the menus change, and the version that they show. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import MAX_VOLUME, SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.menu_items import Call, Function
from sim_backend.firmware.ui.menu_place import neighbour
from sim_backend.firmware.ui.pass_counter import PassCounter
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.stored_settings import SLEEP_MINUTES, StoredSettings

_ERASED, _LEFT = 100, 200
"""The counts of passes at which the version is erased, and left."""


class MenuSettings:
    """The functions VOLUME, SLEEP and VERSION.

    Attributes:
        stored: Volume and sleep time-out as they are kept without power.
        shown: Count of the passes since a key has ended the version, which is never reset.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        screen: ScreenRefresh,
        sound: SoundModule,
        sleep_timer: SleepTimer,
        stored: StoredSettings,
    ) -> None:
        self._registers, self._keys, self._screen, self._sound = registers, keys, screen, sound
        self._sleep_timer, self.stored = sleep_timer, stored
        self._version_step, self.shown = 1, PassCounter(clock)

    @property
    def functions(self) -> Mapping[Function, Callable[[int], bool]]:
        """The functions of items."""
        return {
            Function.VOLUME: self.volume,
            Function.SLEEP: self.sleep,
            Function.VERSION: self.version,
        }

    def volume(self, argument: int) -> bool:
        """Show, change, keep or restore the volume."""
        registers, stored = self._registers, self.stored
        if argument == Call.ENTER:
            stored.volume = registers.counter - 1 & 0xFF
            stored.save()
            self._sound.volume = stored.volume
        if argument in (Call.ENTER, Call.EXIT):
            registers.volume = stored.volume
            registers.go_to(UiState.EXIT)
        else:
            self._choose(argument, stored.volume, MAX_VOLUME + 1)
            if argument != Call.OPEN:
                registers.volume = registers.counter - 1 & 0xFF
        return False

    def sleep(self, argument: int) -> bool:
        """Show, change or keep the sleep time-out."""
        if argument == Call.ENTER:
            self.stored.sleep = self._registers.counter - 1 & 0xFF
            self.stored.save()
            self._sleep_timer.limit_minutes = self.stored.sleep_minutes
            self._registers.go_to(UiState.EXIT)
        else:
            self._choose(argument, self.stored.sleep, len(SLEEP_MINUTES))
        return False

    def _choose(self, argument: int, present: int, values: int) -> None:
        registers = self._registers
        if argument == Call.OPEN:
            registers.counter = present + 1
        else:
            registers.counter = neighbour(registers.counter, argument, values)
        self._screen.mark(marks.BAR)

    def version(self, _argument: int) -> bool:
        """Show the version until a key, and for some time after the first one; it has a step of its own."""
        registers, screen = self._registers, self._screen
        match self._version_step:
            case 0:
                self._version_step = 1
            case 1:
                screen.mark(marks.VERSION)
                self._version_step = 2
            case 2 if self._keys.read():
                self._version_step = 3
            case 2:
                registers.rest()
            case _:
                passes = self.shown.count()
                if passes == _ERASED:
                    screen.mark(marks.VERSION_ENDS)
                if passes >= _LEFT:
                    registers.set(UiFlag.REDRAW_STATUS)
                    self._version_step = 0
        return bool(self._version_step)
