"""The pages of the menus that list, send or delete files, or keep a data log. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.ui import data_log, log_menu
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import menu_places as places
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_states import Action, KeyStates
from sim_backend.firmware.ui.menu_places import Place, Places
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.stored_settings import StoredSettings


class MenuFiles:
    """Looks up and changes files, and shows that by the states of a key.

    Args:
        loader: Holds the files.
        stored: Counts the data logs.
        places: Lists the files.
        states: Shows it.

    Attributes:
        chosen: Name of the file that was opened or chosen in a list last.
        shown: Number of the files in the list that was drawn last.
    """

    def __init__(self, loader: Loader, stored: StoredSettings, places: Places, states: KeyStates) -> None:
        self._loader, self._stored, self._places, self._states = loader, stored, places, states
        self.chosen, self.shown = "", 0
        self._handle: int | None = None

    def choose(self, menu: Place, item: int) -> int:
        """Choose an item of a menu, if it is a list of files; return their number."""
        names = self._places.listed(menu) if places.is_list(menu) else ()
        if names:
            self.chosen = names[item % len(names)]
        return len(names)

    def enter(self, menu: Place) -> None:
        """Draw a list of files that is entered, twice."""
        self._draw(menu, 0, marks.MENU)
        self._states.add(UiState.DRAWING)
        self._draw(menu, 0, marks.MENU)

    def move(self, menu: Place, item: int) -> bool:
        """Draw a list of files, if it is one, around another file, or leave it if it is empty; return whether not."""
        if self.choose(menu, item):
            self._draw(menu, item)
        elif places.is_list(menu):
            self.find_none()
            return False
        return True

    def show_first(self, menu: Place) -> bool:
        """Draw a list of files after the page of a file, or leave it if it is empty; return whether it is not."""
        return self._show(menu, self.choose(menu, 0))

    def _show(self, menu: Place, files: int) -> bool:
        self._states.draw_last(marks.MENU)
        self._states.add(UiState.DRAWING)
        if files:
            self._draw(menu, 0, marks.MENU)
        else:
            self.find_none()
        return files > 0

    def _draw(self, menu: Place, item: int, *last: Marks) -> None:
        """Draw a list around a file; passes for each of the files that exist by then come in between."""
        around = marks.listed(self._places.items(menu), item)
        self._states.draw_last(NOTHING, NOTHING, around, *last, actions={1: partial(self._look, menu, item)})

    def _look(self, menu: Place, item: int) -> None:
        """Begin to look through a list: count its files, one in each pass, and then find the chosen one."""
        files = self.choose(menu, item)
        if files:
            self.shown, pattern = files, "*" + places.extension(menu)
            first, *others = *self._search(pattern, files), *self._search(pattern, min(item, files))
            first()
            self._states.insert(others, marks.listed(files, min(item, files - 1)))

    def _search(self, pattern: str, others: int) -> Sequence[Action]:
        """Return what the passes of a search do: they find the first file and some others; the last one closes it."""
        *looks, last = partial(self._find_first, pattern), *[self._find_next] * others
        return [*looks, partial(self._end_search, last)]

    def _find_first(self, pattern: str) -> None:
        status, handle, _ = self._loader.find_first(pattern)
        self._handle = None if status else handle

    def _find_next(self) -> None:
        if self._handle is not None:
            self._loader.find_next(self._handle)

    def _end_search(self, look: Action) -> None:
        look()
        if self._handle is not None:
            self._loader.close(self._handle)

    def find_none(self) -> None:
        """Leave a list of files that is empty."""
        self._states.draw_last(NOTHING, NOTHING)
        self._states.show(UiState.EXIT)

    def send(self) -> None:
        """Send the chosen file; no other brick is in reach."""
        self._states.draw_last(*drawing.SENT)
        self._states.show(UiState.EXIT)

    def delete(self, menu: Place) -> bool:
        """Delete the chosen file of a list, and draw what is left of that; return whether anything is."""
        self._states.draw_last(*drawing.DELETED, actions={0: partial(self._loader.delete, self.chosen)})
        self._states.show(UiState.EXIT)
        return self._show(menu, self._places.items(menu) - 1)

    def keep_log(self, item: int) -> None:
        """Store the data log under a number, or delete it."""
        states = self._states
        if item == log_menu.STORE:
            states.draw_last(*drawing.STORED, actions={0: self._stored.count_log, 1: self._store_log})
            states.add(UiState.MENU, UiState.DRAWING)
        else:
            states.draw_last(*drawing.LOG_DELETED, actions={0: partial(self._loader.delete, data_log.FILE)})

    def _store_log(self) -> None:
        self._loader.rename(data_log.FILE, f"OBD_{self._stored.logs}.log")

    def erase(self, item: int) -> None:
        """Delete all files of a type, one in each pass."""
        names = self._places.erased(item)
        deletes = [partial(self._loader.delete, name) for name in names]
        self._states.draw_last(*drawing.erased(len(names)), actions=dict(enumerate(deletes, 2)))
        self._states.show(UiState.EXIT)
