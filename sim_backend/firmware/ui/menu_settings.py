"""The settings that the menus change. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer
from sim_backend.firmware.ui.stored_settings import StoredSettings


class MenuSettings:
    """Volume and sleep time-out.

    Args:
        registers: Holds the volume.
        sleep_timer: Holds the sleep time-out.
        stored: Both as they are kept without power.
    """

    def __init__(self, registers: UiRegisters, sleep_timer: SleepTimer, stored: StoredSettings) -> None:
        self._registers, self._sleep_timer, self.stored = registers, sleep_timer, stored

    def set_volume(self, volume: int) -> None:
        """Change the volume for now."""
        self._registers.volume = volume

    def store_volume(self, volume: int) -> None:
        """Change and keep the volume."""
        self._registers.volume = self.stored.volume = volume
        self.stored.save()

    def store_sleep(self, number: int) -> None:
        """Change and keep the sleep time-out, which is given by its number."""
        self.stored.sleep = number
        self._sleep_timer.limit_minutes = self.stored.sleep_minutes
        self.stored.save()
