"""The places in the menus: the numbers of the items that lead there, and how many items each menu has.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sim_backend.firmware.radio import Radio
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.ui.log_menu import DATA_LOG, LogMenu
from sim_backend.firmware.ui.program_steps import PROGRAM, ProgramSteps
from sim_backend.firmware.ui.sensor_view import VIEW, SensorView
from sim_backend.firmware.ui.states import Place
from sim_backend.firmware.ui.stored_settings import SLEEP_MINUTES

MY_FILES, TYPES, RADIO, SETTINGS, TRY_ME = (0,), (PROGRAM,), (4,), (5,), (6,)
VALUES = (VIEW,)
LISTS = DATA_LOG, VALUES
CONTACTS, CONNECTIONS, VISIBILITY, SWITCH, SEARCH = ((*RADIO, item) for item in range(5))
VOLUME, SLEEP, VERSION, ERASE = ((*SETTINGS, item) for item in range(4))
PROGRAMS = (*MY_FILES, 0)
RUN, SEND, DELETE = range(3)
_ACTIONS, _LOG_ACTIONS, _TRIED_ACTIONS = (RUN, SEND, DELETE), (DELETE, SEND), (DELETE, RUN)
"""Items of a file's page, of that of a data log, and of that of a file to try."""
NO, YES = range(2)
"""Answers to the question whether to delete a file."""

SLOW = range(1, 4)
"""Items of the main menu whose pages are drawn in two passes."""

_ITEMS = {(): 7, RADIO: 5, VISIBILITY: 2, SWITCH: 2, SETTINGS: 4, VOLUME: MAX_VOLUME + 1, SLEEP: len(SLEEP_MINUTES)}
"""Items of the menus that are known."""

_LOG = ".log"
EXTENSIONS = (".rxe", ".rpg", ".rso", _LOG)
"""Files of the items of the first menu."""
_TRIED = ".rtm"
"""Files of the last item of the main menu."""

_LIST_LEVEL, _PAIR = 2, 2


def is_list(menu: Place) -> bool:
    """Return whether a menu is a list of files."""
    return menu == TRY_ME or (len(menu) == _LIST_LEVEL and menu[: len(MY_FILES)] == MY_FILES)


def is_page(menu: Place) -> bool:
    """Return whether a menu is a file's page."""
    return is_list(menu[:-1])


def extension(files: Place) -> str:
    """Return the extension of the names in a list of files."""
    return _TRIED if files == TRY_ME else EXTENSIONS[files[-1]]


def actions(page: Place) -> Sequence[int]:
    """Return what the items of a file's page do."""
    return {_LOG: _LOG_ACTIONS, _TRIED: _TRIED_ACTIONS}.get(extension(page[:-1]), _ACTIONS)


def first_action(page: Place) -> int:
    """Return the item that a file's page begins with: run, if it can be run."""
    return actions(page).index(RUN) if RUN in actions(page) else 0


def action(place: Place) -> int | None:
    """Return what an item of a file's page does; None elsewhere."""
    return actions(place[:-1])[place[-1]] if is_page(place[:-1]) else None


def moved(item: int, step: int, items: int) -> int:
    """Return the item to the left (-1) or right (1) of one: two stop at their ends, more are a ring; 0 are unknown."""
    if 0 < items <= _PAIR:
        return max(item - 1, 0) if step < 0 else max(item, items - 1)
    if items and item + step < 0:
        return items - 1
    return 0 if 0 < items <= item + step and step > 0 else item + step


def lists_connections(menu: Place) -> bool:
    """Return whether a menu is the list of connections, perhaps to send a file to."""
    return menu == CONNECTIONS or action(menu) == SEND


def asks_to_delete(menu: Place) -> bool:
    """Return whether a menu is the question whether to delete a file, or all files of a type."""
    return menu[:-1] == ERASE or action(menu) == DELETE


class Places:
    """The menus of a brick.

    Args:
        files: Lists the files with an extension.
        program: The program that is made on the brick.
        view: The values that can be shown.
        radio: Sends files while it is on.
        log: The values that can be logged, if the main menu has an item for the data log.
    """

    def __init__(
        self,
        files: Callable[[str], Sequence[str]],
        program: ProgramSteps,
        view: SensorView,
        radio: Radio,
        log: LogMenu | None,
    ) -> None:
        self._files, self._program, self._view, self._radio, self._log = files, program, view, radio, log

    def items(self, menu: Place) -> int:
        """Return the number of items of a menu, 0 if it is not known."""
        if is_list(menu):
            return len(self.listed(menu))
        if is_page(menu):
            return len(actions(menu))
        if menu == MY_FILES:
            return len(self._types) - 1
        if menu == ERASE:
            return len(self._types)
        if self._log and (items := self._log.items(menu)):
            return items
        return _ITEMS.get(menu, 0) or self._program.items(menu) or self._view.items(menu)

    def listed(self, menu: Place) -> Sequence[str]:
        """Return the names of a list of files."""
        return self._files(extension(menu))

    def erased(self, item: int) -> str:
        """Return the pattern of the files that an item of the page to delete files of a type deletes."""
        return "*" + self._types[item % len(self._types)]

    @property
    def _types(self) -> Sequence[str]:
        kept = EXTENSIONS if self._log else EXTENSIONS[:-1]
        return (*kept, _TRIED)

    def next_to(self, place: Place, step: int, items: int) -> int:
        """Return the item to the left (-1) or right (1) of a place in a menu of that many items, 0 if unknown."""
        menu, item, off = place[:-1], place[-1], self._radio.shows_off
        if menu == RADIO and off:
            return item
        if is_page(menu):
            shown = [at for at, each in enumerate(actions(menu)) if each != SEND or not off or at == item]
            return shown[moved(shown.index(item), step, len(shown))]
        item = moved(item, step, items)
        return item + step if (item,) == DATA_LOG and not menu and self._log is None else item
