"""Erasing and drawing by the user interface, as bits of the Display map's masks.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Marks(NamedTuple):
    """Parts of the screen: those to erase and to draw, and those that are no longer to be drawn or erased.

    Lines of text to draw are centered, unless `again` says that they are drawn as they were. Lines of `uncenter` are no
    longer centered, and neither are those that are dropped, unless `keeps_centered` is set.
    """

    erase: int = 0
    update: int = 0
    drop: int = 0
    drop_erase: int = 0
    again: bool = False
    uncenter: int = 0
    keeps_centered: bool = False


FRAME = 0x1000
"""Bit of the frame around the status bar."""
_ALL = 0xFFFF_FFFF
MENU, PAGE = Marks(0x4000_0000, 0xE_0500, drop=_ALL), Marks(0xE_0400, 0xE_0500)
"""An item of the menus, with and without what is behind it erased."""
BAR = Marks(0xC, 0x10_0004)
"""The bar of a value."""
TYPES = Marks(0xFC, 0x10FC, drop=0x100)
"""Where to plug in motors and sensors."""
ERASED_MENU, STEPS, STEPS_TEXT, CURSOR, NO_NAME = (
    Marks(0x4000_0000),
    Marks(0x8, 0x1F00_1800),
    Marks(0x6),
    Marks(update=0x10_0000),
    Marks(0x400),
)
"""The steps of a program that is made on the brick: before the first one, all, their text, the cursor, and a run."""
OPENS_STEPS = Marks(0x8, drop=0x8)
"""A file with such a program that is opened."""
VALUE, VALUE_AGAIN = Marks(0x4000_0000, 0x10_0000, drop=_ALL, keeps_centered=True), Marks(update=0x8)
"""The value of a sensor or motor, besides the status bar, and the same later."""
LIST = Marks(0x8000_0000, 0x4)
TAKEN, READY, REFUSES, REFUSED = Marks(update=0x4), Marks(update=0xC), Marks(update=0x8), Marks(0x8)
"""The data log: a port is chosen, all of them are, and the message that one is not free, and its end."""
ERASED = Marks(0xE_0400)
"""The end of the question whether to delete all files of a type."""
LOG_TIME, LOG_FAILS, LOG_DELETED, LOG_ERASED = Marks(update=0x8), Marks(0x8000_0000), Marks(0xE_041C), Marks(0x4)
"""The time of a data log that runs, the beginning of one that cannot run, and the end of one that is not kept."""

FILE_NAME, NAMES = Marks(update=0x8, drop=_ALL), Marks(update=0x18, drop=_ALL)
"""The name of a file, and the same with what it does."""
RUNNING, PLAYING, RAN = (Marks(0x4000_0000, 0x1000), Marks(0x4_0000, 0x4_0000), Marks(update=0xE_0400, drop=_ALL))
"""The picture of a file that runs: its beginning, its changes, and its end."""
ENDED = Marks(0x4000_0000, 0x4_0018, drop=_ALL, drop_erase=_ALL, uncenter=0xFF)
"""The end of a file."""
CLOSING = Marks(0x10, 0x8, drop_erase=_ALL, uncenter=0xFF)
"""The end of that message."""
WARNING = Marks(update=0x10_0000)
"""The warning of a low battery."""
MESSAGE = Marks(0xE), Marks(update=0x10_0000), Marks(update=0x1000)
"""The parts of a message."""
VERSION, VERSION_ENDS = Marks(update=0xFC), Marks(0x2000_0000)
"""The version, and its end."""
ICONS, FOUND = Marks(update=0xE_0000), Marks(update=0x400)
"""The beginning and the result of a search of the radio."""
LOGO = Marks(0x2000_0000, 0x10_0000, _ALL, _ALL, keeps_centered=True)
PICTURE = Marks(0x10_0000, 0x10_0000, _ALL, keeps_centered=True)
"""The first picture of a start, and the others."""
EMPTY, ENTRY = Marks(update=0x10_0000, drop=_ALL, keeps_centered=True), Marks(0x2000_0000)
"""The picture of an empty battery in a start, and the end of the pictures."""
STATUS = Marks(0x200, 0x1F200)
"""The status bar."""
TEXT = Marks(0x4000_0000), Marks(0x10_0000, 0x1014, again=True), Marks(update=0x10_0000)
"""The entry of a text, pass by pass: in a question of the radio after the status bar."""
CHARACTER = Marks(0x10_0000)
"""Another character, before the text is drawn again."""
ANSWERED = Marks(0x2000_0000, drop=_ALL)
"""The end of the entry of a text."""


def connections(connected: Sequence[bool]) -> Marks:
    """Return a list of three connections, by whether each one exists."""
    numbers = sum(0x20_0000 << place for place, exists in enumerate(connected) if exists)
    return Marks(0xE_0010, 0xE_0500 | numbers, drop_erase=0x4000_0000)


def listed(items: int, chosen: int) -> Marks:
    """Return the items of a list: the chosen one, from 1 on or 0 for none, in the middle, and one on each side."""
    left, right = items > 2 or items == 2 != chosen + 1, items > 2 or items == 2 == chosen + 1
    return Marks(0xE_0010, 0x500 | left * 0x2_0000 | (chosen > 0) * 0x4_0000 | right * 0x8_0000)


def logged(values: int, chosen: int) -> Marks:
    """Return the chosen value of a data log that runs, and those on each side if there are more."""
    left, right = values > 2 or values > 1 == chosen, values > 2 or values > 1 > chosen
    update = 0x5E_1108 | left * 0x20_0000 | right * 0x80_0000
    return Marks(0x4000_0000, update, drop=_ALL, keeps_centered=True)
