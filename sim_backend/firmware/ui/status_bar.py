"""The icons of the status bar as the display's map numbers them; the bitmaps are LEGO's and are not drawn.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.module import Clock
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_answers import STATES, RadioState
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui.battery import RECHARGEABLE, Battery
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import STATUS, Marks
from sim_backend.firmware.ui.states import STATUS_WORK

_BLUETOOTH, _USB, _BATTERY, _RECHARGEABLE_BATTERY = 0x19, 0x1F, 0x0D, 0x13
"""First icon of each kind."""

_ICONS = 6
"""Icons of a kind; a greater number keeps the last one."""

_FIRST_ICON = 0x2000
"""Bit of UpdateMask for the first icon; the others follow."""

_STEPS = 12
"""Icons of the running sign, from 1."""


class StatusBar:
    """Radio, USB, running sign and battery; the firmware draws it with every sample of the battery.

    Attributes:
        icons: The four icons from the left, as they were drawn last.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        battery: Battery,
        radio: Radio,
        screen: ScreenRefresh,
    ) -> None:
        self._clock, self._registers, self._battery = clock, registers, battery
        self._radio, self._screen = radio, screen
        self._sign_began = 0
        self.icons = bytes((_BLUETOOTH + RadioState.VISIBLE, 0))
        self.preset()

    def restart(self) -> None:
        """Let the running sign begin with the first sample, as at power-on."""
        self._sign_began = 0

    def preset(self) -> None:
        """Show the icons as they were drawn at power-on."""
        self.icons = self._now()

    @property
    def due(self) -> bool:
        """Whether the bar is shown, and was requested to be drawn."""
        flags = self._registers.flags
        return bool(flags & UiFlag.ENABLE_STATUS and flags & STATUS_WORK)

    def follow(self) -> None:
        """Draw the bar on request; without the bar, drop all requests for it."""
        registers = self._registers
        if self.due:
            self.draw(everything=bool(registers.flags & UiFlag.REDRAW_STATUS))
            registers.clear(STATUS_WORK)
        elif not registers.flags & UiFlag.ENABLE_STATUS and self._screen.update_mask & STATUS.update:
            self._screen.mark(Marks(drop=STATUS.update))

    def draw(self, *, everything: bool) -> None:
        """Draw the icons that have changed, or everything."""
        before, self.icons = self.icons, self._now()
        changed = sum(
            _FIRST_ICON << i for i, (old, new) in enumerate(zip(before, self.icons, strict=True)) if old != new
        )
        self._screen.mark(Marks(update=changed))
        if everything:
            self._screen.mark(STATUS)

    def _now(self) -> bytes:
        registers, battery = self._registers, self._battery
        samples = battery.samples(self._clock.now_ms)
        if not registers.run_state:
            self._sign_began = samples
        radio = self._radio.shown_state & STATES
        bluetooth, charge = _BLUETOOTH + radio, battery.shown_bars
        charge += _RECHARGEABLE_BATTERY if battery.raw & RECHARGEABLE else _BATTERY
        icons = (
            bluetooth if radio < _ICONS else self.icons[0],
            _USB + registers.usb_state,
            1 + (samples - self._sign_began) % _STEPS,
            charge if battery.bars < _ICONS else self.icons[-1],
        )
        return bytes(icon & 0xFF for icon in icons)
