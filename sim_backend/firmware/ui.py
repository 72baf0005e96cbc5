"""The user interface module as far as telegrams see it: battery, sleep timer, busy state.

Source: docs/firmware.md section 5.2 (Ui map) and section 8.
"""

from __future__ import annotations

from enum import IntEnum

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.io_control import POWER_DOWN, IoControl
from sim_backend.firmware.module import NEVER, Clock

FRESH_BATTERY = 560
"""Converter value of a good set of batteries, 7.75 V."""

RECHARGEABLE = 0x8000
"""Bit of the battery's converter value: the rechargeable pack is fitted."""

MINUTE_MS = 60_000
_SAMPLE_MS = 167
_LOW_MV, _LOW_RECHARGEABLE_MV = 6100, 7100
_FULL_MV = 7500
_LOW_SAMPLES = 6
_LEVELS = 4


class UiState(IntEnum):
    """State byte of the map: the two states telegrams can meet without a program."""

    WAITING = 7
    LOW_BATTERY = 15


class UiModule:
    """Battery supervision and sleep timer.

    Attributes:
        due_ms: See `Module`.
        battery_mv: Voltage, refreshed every 167 ms.
        flags: See `firmware_protocol.iomap.UiFlag`.
        state: See `UiState`.
        sleep_minutes: Time until power-off, 0 for never.
        force_off: Not 0 to switch the brick off.
    """

    def __init__(self, clock: Clock, io_control: IoControl) -> None:
        self._clock, self._io_control = clock, io_control
        self.due_ms = NEVER
        self.sleep_minutes = 10
        self.flags = int(UiFlag.ENABLE_STATUS)
        self.state = int(UiState.WAITING)
        self.button = self.error = self.pointer = self.force_off = 0
        self.program_name = bytes(20)
        self.run_state, self.bluetooth_state, self.usb_state = 1, 1, 2
        self._timer_started_ms = 0
        self._battery_raw = FRESH_BATTERY
        self._low_samples = 0
        self._sample_battery()
        self._schedule()

    @property
    def rechargeable(self) -> bool:
        """Whether the rechargeable pack is fitted."""
        return bool(self._battery_raw & RECHARGEABLE)

    @property
    def battery_state(self) -> int:
        """Bars of the battery symbol, 0..4; only the ends of the scale are measured."""
        low = _LOW_RECHARGEABLE_MV if self.rechargeable else _LOW_MV
        return min(max((self.battery_mv - low) * _LEVELS // (_FULL_MV - low), 0), _LEVELS)

    def set_battery(self, raw: int) -> None:
        """Change the battery: a 10-bit converter value, plus `RECHARGEABLE`."""
        self._battery_raw = raw
        self.due_ms = min(self.due_ms, _next_sample_ms(self._clock.now_ms))

    @property
    def sleep_timer(self) -> int:
        """Whole minutes since the timer was last reset."""
        return (self._clock.now_ms - self._timer_started_ms) // MINUTE_MS

    def stay_awake(self) -> None:
        """Restart the sleep timer."""
        self._timer_started_ms = self._clock.now_ms
        self._schedule()

    def set_sleep_minutes(self, minutes: int) -> None:
        """Change the time until power-off; 0 is never. The timer goes on counting."""
        self.sleep_minutes = minutes
        self._schedule()

    def wake(self) -> None:
        """Look at everything in the next pass: the map was written."""
        self.due_ms = self._clock.now_ms + 1

    def run(self, now_ms: int) -> None:
        """Look at battery and timer."""
        if now_ms % _SAMPLE_MS == 0:
            self._sample_battery()
        if self.sleep_minutes and self.sleep_timer >= self.sleep_minutes:
            self.force_off = 1
        if self.force_off and not self._io_control.power_word:
            self._io_control.shut_down(POWER_DOWN)
        if self.flags & UiFlag.RESET_SLEEP_TIMER:
            self.flags &= ~UiFlag.RESET_SLEEP_TIMER
            self._timer_started_ms = self._clock.now_ms
        self._schedule()

    def _schedule(self) -> None:
        due = NEVER
        if self.sleep_minutes and not self.force_off:
            due = max(self._timer_started_ms + self.sleep_minutes * MINUTE_MS, self._clock.now_ms + 1)
        if self._voltage() != self.battery_mv or 0 < self._low_samples < _LOW_SAMPLES:
            due = min(due, _next_sample_ms(self._clock.now_ms))
        self.due_ms = due

    def _voltage(self) -> int:
        return (self._battery_raw & 0x3FF) * 13848 // 1000

    def _sample_battery(self) -> None:
        self.battery_mv = self._voltage()
        low = self.battery_mv < (_LOW_RECHARGEABLE_MV if self.rechargeable else _LOW_MV)
        self._low_samples = self._low_samples + 1 if low else 0
        if self._low_samples >= _LOW_SAMPLES:
            self.flags |= UiFlag.BUSY
            self.state = UiState.LOW_BATTERY


def _next_sample_ms(now_ms: int) -> int:
    return (now_ms // _SAMPLE_MS + 1) * _SAMPLE_MS
