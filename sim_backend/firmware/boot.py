"""The start of a brick that has switched itself off. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware import screen_marks as marks
from sim_backend.firmware import ui_states as states
from sim_backend.firmware import ui_times as times
from sim_backend.firmware.module import NEVER
from sim_backend.firmware.supply import Supply
from sim_backend.firmware.ui_states import STARTING, DrawStatus, UiState


class Boot(Supply):
    """A start as at power-on, except that the other modules continue.

    Attributes:
        on_pass: Called in each pass; set by the brick.
        draw_status: Draws the status bar; set by the brick.
    """

    on_pass: Callable[[], None]
    draw_status: DrawStatus
    _on_restart: Callable[[], None]
    error: int

    def end_start(self) -> None:
        """Take keys and requests from now on; a button that is held does not count."""
        if self._starting and self.state == UiState.WAITING:
            self.flags, self._starting = int(UiFlag.ENABLE_STATUS), False
            self._keys.ignore(self.buttons)

    def start(self, now_ms: int) -> None:
        """Start again after the brick was switched off: as at power-on, but the other modules continue."""
        if self.state == UiState.START:
            self._on_restart()
            self._warned, self.run_state, self.error = False, 1, 0
            self.on_pass()
            self.battery.restart(now_ms - 1)
            self._off_ms, self._io_control.display_on, self._screen.on = NEVER, True, True
            self._menu.reset()
        if self._off_ms == NEVER and self.state in (UiState.START, UiState.EMPTY):
            self._show_logo(now_ms)
            return
        state, wait_ms = (UiState.START, 1) if self._off_ms != NEVER else STARTING.get(self.state, (UiState.WAITING, 1))
        self.state, self._next_step_ms = int(state), now_ms + wait_ms
        if state == UiState.MELODY:
            self._screen.begin(now_ms + 1)
        elif state == UiState.ENTRY:
            self._screen.mark(marks.ENTRY)
        elif state == UiState.WAITING:
            self.flags = int(UiFlag.ENABLE_STATUS | UiFlag.BUSY)
            self._screen.mark(marks.MENU)
            self.draw_status(everything=False)

    def watch_start(self, now_ms: int) -> None:
        """Show that the battery is empty instead of the logo, once."""
        if not self._finds_empty or self.battery.since_sample_ms(now_ms) < times.EMPTY_FOUND_MS - 1:
            return
        if self.battery.since_sample_ms(now_ms) < times.EMPTY_FOUND_MS:
            self._screen.mark(marks.EMPTY)
            return
        self._warned = True
        self.flags = self.flags & ~states.STATUS_WORK | int(UiFlag.BUSY | UiFlag.ENABLE_STATUS)
        self.draw_status(everything=True)
        self.state, self._next_step_ms = int(UiState.EMPTY), now_ms + times.EMPTY_MS

    @property
    def _finds_empty(self) -> bool:
        sampled = self.battery.samples(self._clock.now_ms) > 0
        return sampled and not (self.battery.bars or self._warned) and self.state == UiState.LOGO

    def _show_logo(self, now_ms: int) -> None:
        """Show the logo until a refresh of the screen ends."""
        self.flags = int(UiFlag.BUSY)
        self._screen.mark(marks.LOGO)
        self.state = int(UiState.LOGO)
        self._next_step_ms = self._screen.next_pause(now_ms + times.LOGO_MS) - times.LOGO_LEAD_MS
