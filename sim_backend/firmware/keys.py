"""The keys of the menus: which button counts, and when it counts again. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from sim_backend.firmware.button import Button, ButtonState
from sim_backend.firmware.module import NEVER

_FIRST_REPEAT_MS, _REPEAT_MS = 800, 200
"""Time until a button that is held counts again, and between two repetitions."""


class Key(IntEnum):
    """Button byte of the Ui map."""

    LEFT = 1
    ENTER = 2
    RIGHT = 3
    EXIT = 4


EXIT, ENTER = 0, 3
"""Numbers of these buttons in the button module."""

KEYS = ((EXIT, Key.EXIT), (ENTER, Key.ENTER), (1, Key.RIGHT), (2, Key.LEFT))
"""Numbers of the button module and their keys; of several keys the first one counts."""


class Keys:
    """The buttons as a menu reads them: a key counts when none was held before, left and right again while held.

    The key that was pressed first counts again while any is held.

    Args:
        buttons: The four buttons of the button module.

    Attributes:
        repeat_ms: When a held button counts again.
    """

    def __init__(self, buttons: Sequence[Button]) -> None:
        self._buttons = buttons
        self.repeat_ms = NEVER
        self._first: Key | None = None

    @property
    def held(self) -> Key | None:
        """The key that is held."""
        buttons = self._buttons
        return next((key for number, key in KEYS if buttons[number].state & ButtonState.PRESSED), None)

    @property
    def enter_acts(self) -> bool:
        """Whether enter is pressed, or was released since the last sample."""
        return bool(self._buttons[ENTER].state)

    @property
    def changed(self) -> bool:
        """Whether a key was pressed or all were released since the last reading."""
        return (self._first is None) != (self.held is None)

    def ignore(self) -> None:
        """Ignore the button that is held, also when it would count again."""
        self._first, self.repeat_ms = self.held, NEVER

    def read(self, now_ms: int) -> Key | None:
        """Return the key that counts now."""
        key = self.held
        if key is None or self._first is None:
            self._first = key
            self.repeat_ms = now_ms + _FIRST_REPEAT_MS if key in (Key.LEFT, Key.RIGHT) else NEVER
            return key
        if now_ms < self.repeat_ms:
            return None
        self.repeat_ms = now_ms + _REPEAT_MS
        return self._first
