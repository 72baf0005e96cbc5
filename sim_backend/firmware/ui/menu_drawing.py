"""The drawing of the menus, pass by pass. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from sim_backend.firmware.ui import menu_places as places
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.log_menu import START
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.states import Place

OPENED: dict[Place, tuple[Marks, ...]] = {
    places.TYPES: (marks.MENU, marks.TYPES),
    **dict.fromkeys(places.LISTS, (marks.LIST, marks.PAGE)),
}
"""What the passes of a page that is drawn in two draw below the main menu."""

FILE_PAGE = (marks.PAGE, marks.FILE_NAME, marks.PAGE)
"""A file's page."""

CONNECTIONS = tuple(marks.listed(3, chosen) for chosen in range(2))
"""The list of connections to send a file to: when it is entered, and after left or right."""

_SENT_MS, _DELETED_MS, _ERASED_MS, _STORED_MS, _LOG_FAILED_MS = 2620, 1623, 1624, 3129, 2624
"""Passes of the messages that a file was not sent, that it or all of a type (one more for each) were deleted, that a
data log was stored, and that it could not go on."""

_ERASING_MS = 2
"""Passes for which a message waits until it has erased what was there."""


def _message(passes: int, before: int) -> list[Marks]:
    """Return the drawing of a message, which begins after some of its passes, and waits until its erasing is done."""
    return [*[NOTHING] * before, *marks.REPORT, *[NOTHING] * (passes - before - len(marks.REPORT) - _ERASING_MS)]


SENT, DELETED = _message(_SENT_MS, before=2), _message(_DELETED_MS, before=4)
"""The messages that a file was not sent, and that it was deleted."""
STORED, LOG_FAILED = _message(_STORED_MS, before=3), _message(_LOG_FAILED_MS, before=1)
LOG_NOT_BEGUN = LOG_FAILED[:-1]
"""The messages that a data log was stored, that it could not go on, and that none could begin."""
DELETES_AFTER = 2
"""Number of the pass, from 0 on, of the messages about deleted files at whose end these are deleted."""
ERASED = _message(_ERASED_MS, before=4)
ERASED[DELETES_AFTER] = marks.ERASED
"""The message that all files of a type were deleted."""
ERASE_ANSWER = (marks.MENU, marks.READY)
"""The question whether to delete all files of a type."""
SWITCHED, SWITCHED_OFF, SWITCHED_ON = (_message(passes, before=2) for passes in (120, 121, 164))
"""The messages that the radio keeps its state, is switched off (the status bar takes seven more passes), and on."""
SEARCHED = [marks.MENU, *_message(117, before=2), marks.FOUND]
"""The search for devices."""
FOUND_NONE, ABORTED = _message(2621, before=7), _message(1619, before=2) + _message(2614, before=0)
"""The messages that the search finds none, and that it was aborted."""
VERSION_LEFT_AGAIN = (marks.STATUS_BAR, marks.MENU)
VERSION_LEFT = (*[NOTHING] * 99, marks.VERSION_ENDS, *[NOTHING] * 99, *VERSION_LEFT_AGAIN)
"""The end of the page of the version, from the second time on and the first time."""
SAVED, NOT_SAVED = _message(1619, before=1), [*_message(130, before=0)[:-1], marks.MENU]
"""The messages that a program made on the brick was saved, and that there is a file of that name, before its page."""
LOG_DELETED = (NOTHING, marks.LOG_DELETED, NOTHING, NOTHING, marks.MENU)
"""The end of a data log that is deleted."""


def page(place: Place, *, makes_program: bool) -> Marks:
    """Return the drawing at the end of a key's states, where a program is made on the brick or elsewhere."""
    menu = place[:-1]
    if menu == places.TYPES:
        return NOTHING
    below = menu in (places.VOLUME, places.SLEEP) or (menu[:1] in places.LISTS and menu != START)
    return marks.PAGE if makes_program or below or places.action(place) == places.RUN else marks.MENU
