"""Erasing and drawing by the user interface, as bits of the Display map's masks.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from typing import NamedTuple


class Marks(NamedTuple):
    """Parts of the screen: those to erase and to draw, and those that are no longer to be drawn or erased.

    Lines of text to draw are centered, unless `again` says that they are drawn as they were. Lines of `uncenter` are no
    longer centered, and neither are those that are dropped, unless `keeps_centered` is set.

    In a key's passes, what `waits` is only drawn when nothing else is left to erase or draw, `shows_bar` has the status
    bar shown from then on, and `draws_bar` draws all of it if it is shown.
    """

    erase: int = 0
    update: int = 0
    drop: int = 0
    drop_erase: int = 0
    again: bool = False
    uncenter: int = 0
    keeps_centered: bool = False
    waits: bool = False
    shows_bar: bool = False
    draws_bar: bool = False


FRAME = 0x1000
"""Bit of the frame around the status bar."""
_ALL = 0xFFFF_FFFF
NOTHING = Marks()
MENU = Marks(0x4000_0200, 0xFF700, drop=_ALL, shows_bar=True)
PAGE = Marks(0xE0600, 0xFF700, shows_bar=True)
"""A page below a menu: a file's, a value's."""
BAR = Marks(0xC, 0x10_0004)
"""The bar of a value."""
TYPES = Marks(0xFC, 0x10FC, drop=0x100)
FIRST_STEP, STEP, LAST_STEP = (Marks(0x4000_000E, 0x1F10_1800), Marks(0xE, 0x1F10_1800), Marks(0xE, 0x1F00_1800))
"""The steps of a program that is made on the brick: the first, others, and the page after the last."""
NOT_RUN = (
    Marks(0x4000_000E, 0x1F00_1800),
    Marks(0x400),
    *(NOTHING, NOTHING),
    Marks(0xE, 0x1F0E_1C00, drop=_ALL),
    PAGE,
)
"""The start of that program without the file that runs it, pass by pass."""
STARTED_WITH = 2
"""Number of the pass of these in which it is started."""
OPENS_STEPS = Marks(0x8)
"""A file with such a program that is opened."""
VALUE, VALUE_AGAIN = Marks(0x4000_0000, 0x10_0000, drop=_ALL, keeps_centered=True), Marks(update=0x8)
"""The value of a sensor or motor, besides the status bar, and the same later."""
LIST = Marks(0x8000_0000, 0x4)
TAKEN, READY, REFUSES, REFUSED = Marks(update=0x4), Marks(update=0xC), Marks(update=0x8), Marks(0x8)
"""The data log: a port is chosen, all of them are, and the message that one is not free, and its end."""
ERASED = Marks(0xE_0400)
"""The end of the question whether to delete all files of a type."""
LOG_TIME, LOG_FAILS, LOG_DELETED = Marks(update=0x8), Marks(0x8000_0000), Marks(0xE_041C)
"""The time of a data log that runs, the beginning of one that cannot run, and the end of one that is not kept."""
FILE_NAME = Marks(update=0x8, drop=_ALL)

OPENING = Marks(update=0x8, drop=_ALL)
RUNNING = Marks(0x4000_0000, 0x1018, drop=_ALL)
PLAYING = Marks(0x4_0000, 0x4_0000)
"""The picture of a file that runs."""
MESSAGE = Marks(0x4000_0200, 0x5F218, drop=_ALL, drop_erase=_ALL, uncenter=0xFF)
"""The end of a file."""
CLOSING = Marks(0x10, 0xE0408, drop=_ALL, drop_erase=_ALL)
"""The end of that message."""
WARNING = Marks(update=0x10_0000)
"""The warning of a low battery."""
REPORT = Marks(0xE, waits=True), Marks(update=0x10_0000, waits=True), Marks(update=0x1000, waits=True)
"""The parts of a message of the radio."""
VERSION, VERSION_ENDS = Marks(update=0xFC), Marks(0x2000_0000)
"""The version, and its end."""
FOUND = Marks(update=0x400)
"""The result of a search of the radio."""
LOGO, PICTURE = Marks(0x2000_0000, 0x10_0000, _ALL, _ALL, keeps_centered=True), Marks(0x10_0000, 0x10_0000)
"""The first picture of a start, and the others."""
EMPTY, ENTRY = Marks(update=0x10_0000, drop=_ALL), Marks(0x2000_0000)
"""The picture of an empty battery in a start, and the end of the pictures."""
STATUS, STATUS_BAR = Marks(0x200, 0x1F200), Marks(draws_bar=True)
"""The status bar, and the request to draw it."""
TEXT = Marks(0x4000_0000), Marks(0x10_0000, 0x1014, again=True), Marks(update=0x10_0000)
"""The entry of a text, pass by pass: in a question of the radio after the status bar."""
CHARACTER = Marks(0x10_0000)
"""Another character, before the text is drawn again."""
ANSWERED = Marks(0x2000_0000, drop=_ALL, draws_bar=True)
"""The end of the entry of a text."""
STATUS_RUNNING = Marks(0x200, 0x1F218, drop=_ALL)
"""The status bar while a program runs."""


def _neighbours(items: int, chosen: int) -> tuple[bool, bool]:
    """Return whether there is an item to the left and to the right: two items stop at their ends, more are a ring."""
    return items > 2 or items > 1 == chosen, items > 2 or items > 1 > chosen


def listed(items: int, chosen: int) -> Marks:
    """Return the items of a list: the chosen one in the middle, and one on each side if there are more."""
    left, right = _neighbours(items, chosen)
    return Marks(0xE_0010, 0x4_0500 | left * 0x2_0000 | right * 0x8_0000)


def logged(values: int, chosen: int) -> Marks:
    """Return the chosen value of a data log that runs, and those on each side if there are more."""
    left, right = _neighbours(values, chosen)
    update = 0x5E_1108 | left * 0x20_0000 | right * 0x80_0000
    return Marks(0x4000_0000, update, drop=_ALL, keeps_centered=True)
