"""The icons of the status bar as the display's map numbers them; the bitmaps are LEGO's and are not drawn.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import UiModule
from sim_backend.firmware.ui_states import UiState

_BLUETOOTH, _USB, _BATTERY, _RECHARGEABLE = 0x19, 0x1F, 0x0D, 0x13
"""First icon of each kind."""

_STATUS_TEXT, _EVERYTHING, _RUNNING = 0x200, 0x1F200, 0x18
"""Bits of the display's masks when everything is drawn again: erased, drawn, and drawn while a file runs."""

_STEPS = 12
"""Icons of the running sign, from 1."""


class StatusBar:
    """Radio, USB, running sign and battery; the firmware draws it with every sample of the battery.

    Args:
        clock: The brick's time.
        ui: Its battery and states.
        radio: Its state.
        screen: What draws it.
    """

    def __init__(self, clock: Clock, ui: UiModule, radio: Radio, screen: ScreenRefresh) -> None:
        self._clock, self._ui, self._radio, self._screen = clock, ui, radio, screen
        self._shown, self._shown_since_ms = True, 0
        self._last = b""

    def follow(self) -> None:
        """Notice that the bar is hidden, which keeps the icons, or shown again, from the next sample on."""
        shown, now_ms = bool(self._ui.flags & UiFlag.ENABLE_STATUS), self._clock.now_ms
        if self._shown and not shown:
            self._last = self._icons_at(now_ms - 1)
        elif shown and not self._shown:
            self._shown_since_ms = now_ms
        self._shown = shown
        if shown and self._ui.flags & UiFlag.REDRAW_STATUS:
            running = _RUNNING if self._ui.state == UiState.RUNNING else 0
            self._screen.mark(erase=_STATUS_TEXT, update=_EVERYTHING | running)

    @property
    def icons(self) -> bytes:
        """The four icons from the left."""
        now_ms = self._clock.now_ms
        sampled_ms = now_ms - self._ui.battery.since_sample_ms(now_ms)
        return self._icons_at(now_ms) if self._shown and sampled_ms >= self._shown_since_ms else self._last

    def _icons_at(self, now_ms: int) -> bytes:
        ui, battery = self._ui, self._ui.battery
        running = battery.samples(now_ms) % _STEPS if ui.run_state else 0
        charge = (_RECHARGEABLE if battery.rechargeable else _BATTERY) + battery.bars
        return bytes((_BLUETOOTH + self._radio.state & 0xFF, _USB + ui.usb_state & 0xFF, 1 + running, charge))
