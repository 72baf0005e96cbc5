"""The menus of the user interface as far as telegrams see them: where a key leads, and what it changes.

Pictures and texts are LEGO's and are not drawn. Below the second level only the depth is followed, but for programs and
the pages of volume and sleep. Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from sim_backend.firmware.keys import Key
from sim_backend.firmware.sound import MAX_VOLUME
from sim_backend.firmware.ui_states import UiState

_STATES = {
    Key.LEFT: UiState.LEFT,
    Key.ENTER: UiState.ENTER,
    Key.RIGHT: UiState.RIGHT,
    Key.EXIT: UiState.EXIT,
}

_MY_FILES, _BLUETOOTH, _SETTINGS, _TRY_ME = (0,), (4,), (5,), (6,)
_VOLUME, _SLEEP = (*_SETTINGS, 0), (*_SETTINGS, 1)
_PROGRAMS = (*_MY_FILES, 0)
_PAGE = 4
"""Level of a file's page; its first item runs the file."""

_SLOW = range(1, 4)
"""Items of the main menu whose pages are drawn in two passes."""

_SLEEP_MINUTES = (0, 2, 5, 10, 30, 60)
_ITEMS = {(): 7, _MY_FILES: 4, _SETTINGS: 4, _VOLUME: MAX_VOLUME + 1, _SLEEP: len(_SLEEP_MINUTES)}
"""Items of the menus that are known, by their place: the numbers of the items that lead there."""

_PAGE_ITEMS = 3
_EXTENSIONS = (".rxe", ".rpg", ".rso", ".log")
"""Files of the items of the first menu."""


class Settings(Protocol):
    """What the menus change."""

    volume: int
    sleep_minutes: int

    def set_sleep_minutes(self, minutes: int) -> None:
        """Change the time until power-off."""


class Menu:
    """The place in the menus.

    Args:
        settings: The user interface.
        files: Lists the files with an extension.

    Attributes:
        shows_key: Whether the states that the last key brings are not over.
        switches_off: Whether the last key switches the brick off.
        runs: Name of the file that it runs, if any.
    """

    def __init__(self, settings: Settings, files: Callable[[str], Sequence[str]]) -> None:
        self._settings, self._files = settings, files
        self.shows_key = self.switches_off = False
        self.runs = self._file = ""
        self._states: list[tuple[UiState, int]] = []
        self.reset()

    def reset(self) -> None:
        """Go to the first item of the main menu."""
        self._place = [0]
        self._confirms: bool | None = None
        self._volume = self._settings.volume

    def show_file(self, name: str) -> None:
        """Go to the page of the file that was started: four levels down."""
        self._place, self._confirms, self._file = [*_PROGRAMS, 0, 0], None, name

    def press(self, key: int) -> None:
        """Follow a key, a value of `Key`; others do nothing."""
        if key not in tuple(Key):
            return
        self.shows_key, self._states, self.runs = True, [], ""
        value = tuple(self._place[:-1]) in (_VOLUME, _SLEEP)
        self._show(_STATES[Key(key)], 2 if value and key in (Key.LEFT, Key.RIGHT) else 1)
        if self._confirms is not None:
            self._answer(key)
        elif key in (Key.LEFT, Key.RIGHT):
            self._move(1 if key == Key.RIGHT else -1)
        elif key == Key.EXIT:
            self._leave()
        else:
            self._enter()

    def _show(self, state: UiState, drawing: int = 1) -> None:
        """Add the states of a key; the last one is drawn for some passes."""
        self._states += [(state, 1), (UiState.MENU, 1), (UiState.DRAWING, drawing)]

    def next_state(self) -> tuple[UiState, int] | None:
        """The next state that the last key brings, and its passes."""
        self.shows_key = bool(self._states)
        return self._states.pop(0) if self._states else None

    def interrupt(self) -> None:
        """Forget the states to come: a file is started, whose page follows."""
        self.shows_key, self._states = False, []

    def _answer(self, key: int) -> None:
        """Answer whether to switch off."""
        if key in (Key.LEFT, Key.RIGHT):
            self._confirms = key == Key.LEFT
            return
        self.switches_off = bool(self._confirms) and key == Key.ENTER
        self.reset()
        if self.switches_off:
            del self._states[1:]

    def _move(self, step: int) -> None:
        menu = tuple(self._place[:-1])
        self._place[-1] += step
        if items := self._items(menu):
            self._place[-1] %= items
        if menu == _VOLUME:
            self._settings.volume = self._place[-1]

    def _items(self, menu: tuple[int, ...]) -> int:
        """Number of items of a menu, 0 if it is not known."""
        if menu == _PROGRAMS:
            return len(self._files(_EXTENSIONS[0]))
        return _PAGE_ITEMS if self._is_page(menu) else _ITEMS.get(menu, 0)

    def _is_page(self, menu: tuple[int, ...]) -> bool:
        return len(menu) == _PAGE - 1 and menu[: len(_PROGRAMS)] == _PROGRAMS

    def _leave(self) -> None:
        if len(self._place) == 1:
            self._confirms = True
            return
        if tuple(self._place[:-1]) == _VOLUME:
            self._settings.volume = self._volume
            self._show(UiState.EXIT)
            self._place.pop()
        self._place.pop()

    def _enter(self) -> None:
        menu, place = tuple(self._place[:-1]), tuple(self._place)
        if menu == _VOLUME:
            self._volume = self._settings.volume
            self._show(UiState.EXIT)
            self._leave()
        elif menu == _SLEEP:
            self._settings.set_sleep_minutes(_SLEEP_MINUTES[self._place.pop()])
            self._show(UiState.EXIT)
        elif menu == _MY_FILES and not self._files(_EXTENSIONS[self._place[-1]]):
            self._find_nothing()
        elif self._is_page(menu) and not place[-1]:
            self.runs = self._file
        elif place in (_TRY_ME, (*_BLUETOOTH, 0)):
            self._show(UiState.ENTER)
            self._find_nothing()
        else:
            self._open(place)

    def _find_nothing(self) -> None:
        """Leave a list of files that is empty."""
        self._states[-1] = (UiState.DRAWING, 2)
        self._show(UiState.EXIT)

    def _open(self, place: tuple[int, ...]) -> None:
        first = 0
        names = self._files(_EXTENSIONS[0]) if place[:-1] == _PROGRAMS else ()
        if names:
            self._file = names[place[-1] % len(names)]
        if place == _VOLUME:
            first = self._volume = self._settings.volume
        elif place == _SLEEP and self._settings.sleep_minutes in _SLEEP_MINUTES:
            first = _SLEEP_MINUTES.index(self._settings.sleep_minutes)
        self._place.append(first)
        self._states[-1] = (UiState.DRAWING, 3 if place in (_VOLUME, _SLEEP) else 1 + (place[0] in _SLOW))
