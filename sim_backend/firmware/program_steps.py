"""The page of the menus where a program of five steps is made on the brick. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

_ACTIONS = (0x3, 0x2, 0x9, 0x8, 0xF, 0x7, 0xB, 0xC, 0x4, 0xA, 0x5, 0x6, 0x1, 0xD, 0xE)
_EVENTS = (0x11, 0x16, 0x17, 0x18, 0x13, 0x14, 0x12, 0x19, 0x15)
_ENDS = (0x20, 0x1F)
_CHOICES = (_ACTIONS, _EVENTS, _ACTIONS, _EVENTS, _ENDS)
"""Icons of the items of each step."""

PROGRAM = 1
"""Item of the main menu."""

_FIRST = 2
"""Level of the first step, below the page that shows where to plug in motors and sensors."""

_EMPTY = 0x01


class ProgramSteps:
    """The steps that were chosen.

    Attributes:
        icons: The icon of each step, as the display's map has them.
    """

    def __init__(self) -> None:
        self.icons = bytes(len(_CHOICES))

    def is_step(self, menu: list[int]) -> bool:
        """Return whether a menu, given as the items that lead to it, is one of the steps."""
        return menu[:1] == [PROGRAM] and _FIRST <= len(menu) < _FIRST + len(_CHOICES)

    def items(self, menu: list[int]) -> int:
        """Return the number of items of a step, 0 of another menu."""
        return len(_CHOICES[len(menu) - _FIRST]) if self.is_step(menu) else 0

    def enter(self, place: list[int]) -> None:
        """Choose an item of a step, or begin with the first one."""
        step = len(place) - 1 - _FIRST
        if step == -1:
            self.icons = bytes([_EMPTY] * len(_CHOICES))
        elif self.is_step(place[:-1]):
            self._set(step, _CHOICES[step][place[-1]])

    def leave(self, place: list[int]) -> None:
        """Go back from a step other than the first one, and forget the choice there, if it is a step."""
        if self.is_step(place[:-1]):
            self._set(len(place) - 1 - _FIRST, _EMPTY)

    def _set(self, step: int, icon: int) -> None:
        icons = bytearray(self.icons)
        icons[step] = icon
        self.icons = bytes(icons)
