"""States that are written after the brick has switched itself off. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import states, times
from sim_backend.firmware.ui.power_off import PowerOff
from sim_backend.firmware.ui.radio_dialog import RadioDialog
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState


class OffStates:
    """Switches the brick on or off again from a state that was written.

    States 2, 3 and 14 continue the count of passes that began when the power was switched off.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        screen: ScreenRefresh,
        power_off: PowerOff,
        dialog: RadioDialog,
        go_on_from: Callable[[int], None],
    ) -> None:
        self._clock, self._registers, self._screen = clock, registers, screen
        self._power_off, self._dialog, self._go_on_from = power_off, dialog, go_on_from
        self._melody_ends_ms = self._message_ends_ms = NEVER

    def enter(self, state: int, *, ran: bool) -> None:
        """Follow a state; `ran` says whether a file had the screen."""
        registers, now_ms, count = self._registers, self._clock.now_ms, self._power_off.count
        if ran and state != UiState.OPENING:
            return
        match state:
            case UiState.LOGO:  # the count begins again at the length of a picture
                began_ms = now_ms + max(times.PICTURE_MS - count, 0)
                self._melody_ends_ms = began_ms + times.MELODY_PASSES
                registers.next_step_ms = began_ms + times.PICTURE_MS + 1
            case UiState.MELODY if count >= times.MELODY_PASSES:
                self._switch_on()
            case UiState.MELODY:
                registers.next_step_ms = now_ms + times.MELODY_PASSES - count
            case UiState.RUNNING:  # it counts twice in a pass
                registers.next_step_ms = self._message_ends_ms = now_ms + (times.MESSAGE_PASSES - count) // 2 + 1
            case UiState.MENU:
                registers.next_step_ms = now_ms
            case UiState.START | UiState.ENTRY:
                self._switch_on()
            case UiState.OPENING:
                self._go_on_from(state)
            case _ if state in states.KEY_STATES.values():
                registers.next_step_ms = now_ms
            case _ if state in states.RADIO_SHOWN:
                self._dialog.begin(state)

    def go_on(self) -> bool:
        """Take the next step of a state; return whether it was one of these."""
        registers, now_ms, state = self._registers, self._clock.now_ms, self._registers.state
        if state == UiState.LOGO and not self._screen.stopped:
            self._screen.end_refresh()
            registers.next_step_ms = now_ms + 1
        elif state == UiState.LOGO:
            self._screen.refresh()
            registers.state, registers.next_step_ms = int(UiState.MELODY), self._melody_ends_ms
        elif state == UiState.MELODY:
            self._switch_on()
        elif state == UiState.RUNNING and now_ms == self._message_ends_ms:
            self._screen.mark(marks.CLOSING)
            registers.state, registers.next_step_ms = int(UiState.MENU), now_ms + 1
        elif state in states.KEY_STATES.values():
            registers.state, registers.next_step_ms = int(UiState.MENU), now_ms + 1
        elif state == UiState.MENU:
            registers.force_off = 1
        else:
            return False
        return True

    def _switch_on(self) -> None:
        self._registers.off_ms = NEVER
        self._go_on_from(self._registers.state)
