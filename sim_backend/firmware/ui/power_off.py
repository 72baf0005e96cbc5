"""How the brick switches itself off. Source: docs/firmware.md section 8."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import ProgramStatus
from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import times
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import Programs, UiState


class PowerOff:
    """The function OFF: it stops the program, then switches off the display and the power.

    The bench's brick stays on after the command to its power supply, and takes keys again later.
    """

    def __init__(
        self,
        registers: UiRegisters,
        keys: KeyInput,
        screen: ScreenRefresh,
        programs: Programs,
        radio: Radio,
        io_control: IoControl,
        sleep_timer: SleepTimer,
    ) -> None:
        self._registers, self._keys, self._screen = registers, keys, screen
        self._programs, self._radio, self._io_control, self._sleep_timer = programs, radio, io_control, sleep_timer
        self._leaves_radio = False

    def follow(self, call: Callable[[], None]) -> None:
        """Begin to switch off when the sleep timer has expired, or on request."""
        registers = self._registers
        if self._sleep_timer.expired:
            registers.force_off = 1
        if registers.force_off:
            registers.force_off = 0
            registers.end(UiState.DRAWING)
            call()

    def run(self, _argument: int) -> bool:
        """Switch off the display, then the power, each a pass after the maps show it; later take keys."""
        registers = self._registers
        match registers.step:
            case 0:
                if self._programs.active:
                    self._programs.stop()
                registers.step = 1
            case 1 if self._programs.status != ProgramStatus.RUNNING:
                self._screen.on = False
                self._leaves_radio = self._radio.disconnect()
                registers.step = 2
            case 2 if not (self._leaves_radio and self._radio.seems_busy):
                self._io_control.announce_power_down()
                registers.step, registers.timer.value = 3, 0
            case 3:
                left = times.NO_KEYS_PASSES - registers.timer.count()
                if left > 0:
                    registers.rest(left)
                else:
                    registers.step = 4
            case 4:
                self._io_control.take_back()
                registers.rest()
                if self._keys.read() == Key.ENTER:
                    self._io_control.stays_on = False
                    registers.rest(1)
                    registers.step = 5
            case 1 | 2:
                pass
            case _:
                registers.end(UiState.START)
        return bool(registers.step)
