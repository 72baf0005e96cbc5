"""The keys of the user interface: buttons, and the key that is written to its map.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.button import Button
from sim_backend.firmware.keys import Key, Keys
from sim_backend.firmware.module import Clock
from sim_backend.firmware.sleep_timer import SleepTimer
from sim_backend.firmware.sound import CLICK, SoundModule
from sim_backend.firmware.ui_registers import UiRegisters


class KeyInput:
    """Reads keys, each of which clicks and keeps the brick awake.

    Attributes:
        buttons: The buttons as keys.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        buttons: Sequence[Button],
        sound: SoundModule,
        sleep_timer: SleepTimer,
    ) -> None:
        self._clock, self._registers, self._sound, self._sleep_timer = clock, registers, sound, sleep_timer
        self.buttons = Keys(buttons)

    def disabled(self, key: int) -> bool:
        """Return whether a program has disabled a key."""
        flag = UiFlag.DISABLE_EXIT if key == Key.EXIT else UiFlag.DISABLE_LEFT_RIGHT_ENTER
        return bool(self._registers.flags & flag)

    def read(self) -> int:
        """Return the key that counts: a button, or the map's while none that is enabled is held; 0 for none."""
        key: int | None = self.buttons.read(self._clock.now_ms)
        held = self.buttons.held
        if held is None or self.disabled(held):
            key, self._registers.button = self._registers.button, 0
        if not key:
            return 0
        self.click()
        return key

    def click(self) -> None:
        """Click, and stay awake."""
        self._sound.play_own(CLICK, self._registers.volume)
        self._sleep_timer.restart(self._clock.now_ms)
