"""How the brick switches itself off. Source: docs/firmware.md section 8."""

from __future__ import annotations

from sim_backend.firmware.io_control import IoControl
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.states import Programs, UiState


class PowerOff:
    """Switches off, the display before the power, when the sleep timer has expired or on request.

    The bench's brick stays on after the command to its power supply, and takes keys again later.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        screen: ScreenRefresh,
        programs: Programs,
        radio: Radio,
        io_control: IoControl,
        sleep_timer: SleepTimer,
    ) -> None:
        self._clock, self._registers, self._screen, self._programs = clock, registers, screen, programs
        self._radio, self._io_control, self._sleep_timer = radio, io_control, sleep_timer
        self._down_ms = NEVER
        self._leaves_radio = self._ignores_keys = False

    @property
    def takes_keys(self) -> bool:
        """Whether a key starts the brick again."""
        registers = self._registers
        return not registers.is_on and registers.state == UiState.DRAWING and self._was_down

    @property
    def _was_down(self) -> bool:
        """Whether the last power-down is over, also after a restart."""
        return self._clock.now_ms >= self._down_ms + times.NO_KEYS_MS

    @property
    def count(self) -> int:
        """Passes since the power was switched off, at most `times.NO_KEYS_MS`; `times.MESSAGE_PASSES` before that."""
        if self._down_ms == NEVER:
            return times.MESSAGE_PASSES
        return min(max(self._clock.now_ms - self._down_ms + 1, 0), times.NO_KEYS_MS)

    @property
    def due_ms(self) -> int:
        """The next pass with a step of switching off; `NEVER` while the brick is on."""
        now_ms = self._clock.now_ms
        if self._registers.is_on:
            return NEVER
        if now_ms <= self._down_ms:
            return now_ms + 1
        return NEVER if self._was_down else self._down_ms + times.NO_KEYS_MS

    def follow(self, before: int) -> None:
        """Decide whether to switch off, or take the next step of it; `before` is the state at the pass's begin."""
        registers, now_ms = self._registers, self._clock.now_ms
        if self._sleep_timer.expired:
            registers.force_off = 1
        if registers.force_off:
            if self._was_down and not self._ignores_keys:
                self._io_control.take_back()
            registers.off_ms, self._down_ms = now_ms, NEVER
            registers.state, registers.next_step_ms, registers.from_menu = int(UiState.DRAWING), NEVER, False
        elif self._keeps_on and (before != UiState.DRAWING or self._before_power_down(now_ms)):
            self._screen.on &= now_ms < registers.off_ms + times.DISPLAY_OFF_MS - 1
            registers.off_ms = NEVER
        elif now_ms == registers.off_ms + 1 and self._programs.active:
            self._programs.stop()
        registers.force_off = 0
        self._switch_off(now_ms - registers.off_ms, may_power_down=before == UiState.DRAWING)

    @property
    def _keeps_on(self) -> bool:
        """Whether the state ends the power-down; some lead back to the one in which the brick switches itself off."""
        registers, state = self._registers, self._registers.state
        ends = state not in states.LEAD_OFF and (state != UiState.RUNNING or registers.runs_file)
        return ends and self._down_ms == NEVER and not registers.is_on

    def _before_power_down(self, now_ms: int) -> bool:
        """Return whether the decision to switch off was made, but the radio has not ended its connections."""
        deciding = now_ms < self._registers.off_ms + times.DISPLAY_OFF_MS
        return deciding or (self._leaves_radio and self._radio.seems_busy)

    def _switch_off(self, passed_ms: int, *, may_power_down: bool) -> None:
        """Switch display and power off, each a pass after the maps show it; later take keys again."""
        now_ms = self._clock.now_ms
        if passed_ms == times.DISPLAY_OFF_MS - 1:
            self._screen.on = False
            self._leaves_radio = self._radio.disconnect()
        elif may_power_down and passed_ms >= 0 and self._down_ms == NEVER and not self._before_power_down(now_ms):
            self._down_ms = now_ms
        down_ms = now_ms - self._down_ms
        if down_ms == times.NO_KEYS_MS and self._registers.state == UiState.DRAWING and not self._registers.from_menu:
            self._io_control.take_back()
            self._ignores_keys = False
        elif down_ms == 0:
            self._io_control.announce_power_down()
            self._ignores_keys = True
        elif 0 < down_ms < times.NO_KEYS_MS:
            self._io_control.send()
