"""The menus of the data log: values of sensors and motors are chosen, each with a port, and logged.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import message
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.data_log import FILE, VALUES, DataLog
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu_items import PORTS, Call
from sim_backend.firmware.ui.menu_place import MenuPlace
from sim_backend.firmware.ui.message import Message
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.stored_settings import StoredSettings

_PASSES = 1500
"""How long the message that a port has a value already stays, if no key is pressed."""


class LogMenu:
    """The function LOG.

    Args:
        log: Runs with the values that are chosen.
        stored: Counts the logs.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        keys: KeyInput,
        loader: Loader,
        screen: ScreenRefresh,
        sleep_timer: SleepTimer,
        place: MenuPlace,
        shown: Message,
        log: DataLog,
        stored: StoredSettings,
    ) -> None:
        self._clock, self._registers, self._keys, self._loader = clock, registers, keys, loader
        self._screen, self._sleep_timer, self._place = screen, sleep_timer, place
        self._message, self._log, self._stored = shown, log, stored
        self._chosen: dict[int, int] = {}
        self._value = self._port = 0

    def run(self, argument: int) -> bool:
        """Run a pass."""
        registers = self._registers
        match argument:
            case Call.OPEN | Call.EXIT:
                self._screen.mark(marks.LIST)
                if argument == Call.OPEN:
                    self._chosen.clear()
            case Call.TEXT if self._chosen:
                self._screen.mark(marks.READY)
            case Call.TEXT:
                self._leave()
            case Call.RUN:
                self._execute()
            case Call.SAVE:
                self._save()
            case Call.DELETE:
                self._delete()
            case Call.SELECT:
                self._screen.mark(marks.TAKEN)
                self._chosen[self._port] = self._value
                registers.go_to(UiState.EXIT)
            case _:
                self._choose(argument)
        return bool(registers.step)

    def _leave(self) -> None:
        """Go to the menu before this one."""
        self._place.leave()
        self._registers.end(UiState.MENU)

    def _choose(self, argument: int) -> None:
        """Choose a value, or a port, which is refused if it has a value."""
        registers = self._registers
        if registers.step:
            left = _PASSES - registers.timer.count()
            if left > 0 and not self._keys.read():
                registers.rest(left)
                return
            self._screen.mark(marks.REFUSED)
            self._place.go_up()
            registers.end(UiState.MENU)
        elif 0 < argument <= len(VALUES):
            self._value = argument - 1
        elif PORTS <= argument < Call.LEFT:
            self._port = argument - PORTS
            if self._port in self._chosen:
                self._screen.mark(marks.REFUSES)
                registers.timer.value, registers.step = 0, 1

    def _execute(self) -> None:
        """Begin a log, take its next step, or end it; show if there is no room."""
        registers, log = self._registers, self._log
        match registers.step:
            case 0:
                opened, begun = log.begin(self._chosen)
                if begun:
                    registers.set(UiFlag.BUSY)
                    registers.timer.value, registers.step = 0, 1
                else:
                    self._screen.mark(marks.LOG_FAILS)
                    registers.step = 4 if opened else 3
            case 1:
                self._go_on()
            case 2:
                log.end()
                registers.clear(UiFlag.BUSY)
                registers.end(UiState.RIGHT)
            case 3 | 4 if not self._message.show(9, 5, passes=message.LONG):
                pass
            case 3:
                self._leave()
            case 4:
                registers.step = 2
            case _:
                registers.rest()

    def _go_on(self) -> None:
        """Take the next step of a log. A sample is not written in the pass of exit."""
        registers, log, key, failed = self._registers, self._log, self._keys.read(), self._log.fails
        next_ms = log.go_on(writes=key != Key.EXIT)
        if failed:
            self._screen.mark(marks.LOG_FAILS)
            registers.step = 4
        if key == Key.EXIT:
            registers.step += 1
        elif key in (Key.LEFT, Key.RIGHT):
            log.choose(1 if key == Key.RIGHT else -1)
        if registers.step == 1 and not (log.fails or log.draws):
            registers.rest(next_ms - self._clock.now_ms)
        self._sleep_timer.rest(self._clock.now_ms)

    def _save(self) -> None:
        """Store the log under the next number."""
        registers = self._registers
        match registers.step:
            case 0:
                self._stored.count_log()
                registers.selected, registers.step = f"OBD_{self._stored.logs}.log", 1
            case 1:
                self._loader.rename(FILE, registers.selected)
                registers.step = 2
            case 2 if self._message.show(8, len(registers.selected), passes=message.LONGEST):
                registers.step = 3
            case 2:
                pass
            case _:
                self._leave()

    def _delete(self) -> None:
        registers = self._registers
        match registers.step:
            case 0:
                self._loader.delete(FILE)
                registers.step = 1
            case 1:
                self._screen.mark(marks.LOG_DELETED)
                registers.timer.value, registers.step = _PASSES, 2
            case 2 if registers.timer.count() >= _PASSES:
                self._screen.mark(marks.LOG_ERASED)
                registers.step = 3
            case 2:
                pass
            case _:
                registers.step = 0
