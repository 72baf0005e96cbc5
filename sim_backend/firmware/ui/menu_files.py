"""The pages of the menus that list, send or delete files, or keep a data log. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.ui import data_log, log_menu
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import menu_places as places
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.menu_places import Places
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.states import Place, UiState
from sim_backend.firmware.ui.stored_settings import StoredSettings


class MenuFiles:
    """Looks up and changes files, and shows that by the states of a key.

    Args:
        loader: Holds the files.
        stored: Counts the data logs.
        places: Lists the files.
        states: Shows it.
        leave: Called to leave a list that has no files.
        sounds: Returns whether a sound plays.

    Attributes:
        chosen: Name of the file that was opened or chosen in a list last.
        shown: Number of the files in the list that was drawn last.
    """

    def __init__(
        self,
        loader: Loader,
        stored: StoredSettings,
        places: Places,
        states: KeyStates,
        *,
        leave: Callable[[], None],
        sounds: Callable[[], bool],
    ) -> None:
        self._loader, self._stored, self._places, self._states = loader, stored, places, states
        self._leave, self._sounds = leave, sounds
        self.chosen, self.shown = "", 0

    def enter(self, menu: Place) -> None:
        """Draw a list of files that is entered, twice."""
        self._draw(menu, 0, marks.MENU)
        self._states.add(UiState.DRAWING)
        self._draw(menu, 0, marks.MENU)

    def move(self, menu: Place, item: int) -> None:
        """Draw a list of files around another file."""
        self._draw(menu, item)

    def show_first(self, menu: Place) -> None:
        """Draw a list of files after the page of a file."""
        self._states.draw_last(marks.MENU)
        self._states.add(UiState.DRAWING)
        self._draw(menu, 0, marks.MENU)

    def _draw(self, menu: Place, item: int, *last: Marks) -> None:
        """Draw a list around a file; passes for each of the files that exist by then come in between."""

        def search() -> None:
            self._go_on(self._search(menu, item))

        keep = self._states.keep_page
        self._states.draw_last(NOTHING, NOTHING, marks.listed(1, 0), *last, actions={1: search, 2: keep, 3: keep})

    def _go_on(self, search: Iterator[None]) -> None:
        """Continue a search, which takes another pass with each file that it finds."""
        for _ in search:
            self._states.insert(partial(self._go_on, search))
            return

    def _search(self, menu: Place, item: int) -> Iterator[None]:
        """Count the files of a list, or leave it if there are none; find one in the same way, and draw around it."""
        loader, pattern, files = self._loader, "*" + places.extension(menu), 0
        status, handle, _ = loader.find_first(pattern)
        if status:
            self._leave()
            return
        while not status:
            files += 1
            yield
            status, *_ = loader.find_next(handle)
        loader.close(handle)
        self.shown = files
        yield
        status, handle, found = loader.find_first(pattern)
        self.chosen = found.name if found else ""
        for _ in range(item):
            if found is None:
                break
            yield
            _, _, found = loader.find_next(handle)
            self.chosen = found.name if found else self.chosen
        if not status:
            loader.close(handle)
        self._states.draw_next(marks.listed(files, min(item, files - 1)))

    def send(self) -> None:
        """Send the chosen file; no other brick is in reach."""
        self._states.draw_last(*drawing.SENT)
        self._states.show(UiState.EXIT)

    def delete(self, menu: Place) -> None:
        """Delete the chosen file of a list, once no sound plays, and draw what is left of that."""
        states, at = self._states, drawing.DELETES_AFTER
        states.draw_last(*drawing.DELETED, actions={at: partial(self._loader.delete, self.chosen)})
        states.hold(at - 1 - len(drawing.DELETED), self._sounds)
        states.show(UiState.EXIT)
        self.show_first(menu)

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
        """Delete all files of a type, one in each pass, once no sound plays; one that is open is awaited."""
        states, at = self._states, drawing.DELETES_AFTER - len(drawing.ERASED)
        states.draw_last(*drawing.ERASED)
        states.hold(at - 1, self._sounds)
        states.hold(at, partial(self._erases, self._places.erased(item)))
        states.show(UiState.EXIT)

    def _erases(self, pattern: str) -> bool:
        """Delete the first file that matches; return whether there was one, which may be open."""
        return self._loader.delete(pattern) in (Status.OK, Status.FILE_IS_BUSY)
