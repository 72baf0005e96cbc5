"""How the brick switches itself off. Source: docs/firmware.md section 8."""

from __future__ import annotations

from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import times
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.page import CurrentPage, Page
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import Programs, Step, UiState


class PowerOff:
    """A page that switches the brick off, the display before the power.

    The bench's brick stays on after the command to its power supply, and takes keys again later.

    Attributes:
        page: That page.
    """

    def __init__(
        self,
        registers: UiRegisters,
        keys: KeyInput,
        current: CurrentPage,
        screen: ScreenRefresh,
        programs: Programs,
        radio: Radio,
        io_control: IoControl,
        sleep_timer: SleepTimer,
    ) -> None:
        self._registers, self._keys, self._current, self._screen = registers, keys, current, screen
        self._programs, self._radio, self._io_control, self._sleep_timer = programs, radio, io_control, sleep_timer
        self.page = Page(self._run, self._run, stays=True)
        self._leaves_radio = False

    def follow(self) -> None:
        """Begin to switch off when the sleep timer has expired, or on request."""
        registers = self._registers
        if self._sleep_timer.expired:
            registers.force_off = 1
        if registers.force_off:
            registers.force_off, registers.step = 0, Step.BEGUN
            registers.go_to(UiState.DRAWING)
            self._current.interrupt()
            self._current.open(self.page)

    def _run(self) -> None:
        """Switch off the display, then the power, each a pass after the maps show it; later take keys."""
        registers = self._registers
        match registers.step:
            case Step.BEGUN:
                if self._programs.active:
                    self._programs.stop()
                registers.step = Step.TONE
            case Step.TONE:
                self._screen.on = False
                self._leaves_radio = self._radio.disconnect()
                registers.step = Step.DRAWING
            case Step.DRAWING if not (self._leaves_radio and self._radio.seems_busy):
                self._io_control.announce_power_down()
                registers.step, registers.timer.value = Step.MESSAGE, 0
            case Step.MESSAGE:
                self._stay_off()
                return
            case Step.STARTS:
                self._current.end()
                registers.go_to(UiState.START)
        registers.wake_in(1)

    def _stay_off(self) -> None:
        """Take the command to switch off back once keys count again; enter starts the brick."""
        registers = self._registers
        left = times.NO_KEYS_PASSES - registers.timer.value
        if left > 0:
            registers.timer.count()
            registers.wake_in(left)
            return
        self._io_control.take_back()
        if self._keys.read() == Key.ENTER:
            self._keys.ignore()
            registers.step, self._io_control.stays_on = Step.STARTS, False
            registers.wake_in(1)
