"""A text that is entered with the keys: a PIN, or the name of a program. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Sequence
from string import ascii_lowercase

from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.screen_marks import Marks

_END = ""
"""The item that ends the entry."""
_RING = (_END, *ascii_lowercase, *"0987654321")

_LONGEST = 15


class TextEntry:
    """The entry of a text.

    Args:
        offered: The text to begin with.

    Attributes:
        text: What was entered.
    """

    def __init__(self, offered: str) -> None:
        self.text, self._place, self._is_offered = offered, 0, True

    def press(self, key: int) -> bool:
        """Follow a key: choose, add or delete a character; return whether it ends the entry.

        The first exit deletes all of the text that is offered, and exit without a character ends.
        """
        character = _RING[self._place]
        if key in (Key.LEFT, Key.RIGHT):
            self._place = (self._place + (1 if key == Key.RIGHT else -1)) % len(_RING)
        elif key == Key.ENTER and character != _END:
            self.text, self._is_offered = (self.text + character)[:_LONGEST], False
        elif key == Key.EXIT and self.text:
            self.text, self._is_offered = "" if self._is_offered else self.text[:-1], False
        else:
            return key in (Key.ENTER, Key.EXIT)
        return False

    @property
    def drawn(self) -> Sequence[Marks]:
        """What is drawn after a key, pass by pass."""
        return marks.TEXT[1:] if _RING[self._place] == _END else marks.TEXT[1:2]
