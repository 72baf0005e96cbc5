"""The keys of the user interface: buttons, and the key that is written to its map.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.button import ENTER_BUTTON, Button, ButtonState
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sound import CLICK, SoundModule
from sim_backend.firmware.ui.keys import KEYS, Key
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.sleep_timer import SleepTimer

_FIRST_REPEAT_MS, _REPEAT_MS = 800, 200
"""Time until a button that is held counts again, and between two repetitions."""


class KeyInput:
    """Reads keys, each of which clicks and keeps the brick awake.

    A button counts when none was held before, left and right again while held. The one that was pressed first counts
    again while any is held.

    Attributes:
        repeat_ms: When a held button counts again.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        buttons: Sequence[Button],
        sound: SoundModule,
        sleep_timer: SleepTimer,
    ) -> None:
        self._clock, self._registers, self._buttons = clock, registers, buttons
        self._sound, self._sleep_timer = sound, sleep_timer
        self.repeat_ms = NEVER
        self._first: Key | None = None

    @property
    def held(self) -> Key | None:
        """The button that is held, of those that no program has disabled."""
        buttons = self._buttons
        held = (key for number, key in KEYS if buttons[number].state & ButtonState.PRESSED and not self.disabled(key))
        return next(held, None)

    @property
    def enter_acts(self) -> bool:
        """Whether enter is pressed, or was released since the last sample."""
        return bool(self._buttons[ENTER_BUTTON].state)

    def disabled(self, key: int) -> bool:
        """Return whether a program has disabled a key."""
        flag = UiFlag.DISABLE_EXIT if key == Key.EXIT else UiFlag.DISABLE_LEFT_RIGHT_ENTER
        return bool(self._registers.flags & flag)

    def read_button(self) -> Key | None:
        """Return the button that counts now; it does not click."""
        key, now_ms = self.held, self._clock.now_ms
        if key is None or self._first is None:
            self._first = key
            self.repeat_ms = now_ms + _FIRST_REPEAT_MS if key in (Key.LEFT, Key.RIGHT) else NEVER
            return key
        if now_ms < self.repeat_ms:
            return None
        self.repeat_ms = now_ms + _REPEAT_MS
        return self._first

    def read_silently(self) -> int:
        """Return the key that counts: a button, or the map's while none is held; 0 for none. It does not click."""
        key: int | None = self.read_button()
        if self.held is None:
            key, self._registers.button = self._registers.button, 0
        return key or 0

    def read(self) -> int:
        """Return the key that counts, and click."""
        key = self.read_silently()
        if key:
            self.click()
        return key

    def click(self) -> None:
        """Click, and stay awake."""
        self._sound.play_own(CLICK, self._registers.volume)
        self._sleep_timer.restart(self._clock.now_ms)
