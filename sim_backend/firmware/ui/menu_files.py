"""The pages of the menus that list or delete files, or keep a data log. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from functools import partial

from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.ui import data_log, log_menu
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui.key_states import KeyStates
from sim_backend.firmware.ui.menu_places import Places
from sim_backend.firmware.ui.screen_marks import NOTHING
from sim_backend.firmware.ui.states import UiState
from sim_backend.firmware.ui.stored_settings import StoredSettings


class MenuFiles:
    """Changes files, and shows that by the states of a key.

    Args:
        loader: Has the files.
        stored: Counts the data logs.
        places: Lists the files.
        states: Shows it.
    """

    def __init__(self, loader: Loader, stored: StoredSettings, places: Places, states: KeyStates) -> None:
        self._loader, self._stored, self._places, self._states = loader, stored, places, states

    def find_none(self) -> None:
        """Leave a list of files that is empty."""
        self._states.draw_last(NOTHING, NOTHING)
        self._states.show(UiState.EXIT)

    def keep_log(self, item: int) -> None:
        """Store the data log under a number, or delete it."""
        states = self._states
        if item == log_menu.STORE:
            states.actions = [self._stored.count_log, self._store_log]
            states.draw_last(*drawing.STORED)
            states.add(UiState.MENU, UiState.DRAWING)
        else:
            states.actions = [partial(self._loader.delete, data_log.FILE)]
            states.draw_last(*drawing.LOG_DELETED)

    def _store_log(self) -> None:
        self._loader.rename(data_log.FILE, f"OBD_{self._stored.logs}.log")

    def erase(self, item: int) -> None:
        """Delete all files of a type, one in each pass."""
        names, states = self._places.erased(item), self._states
        states.actions = [drawing.wait, drawing.wait, *(partial(self._loader.delete, name) for name in names)]
        states.draw_last(*drawing.erased(len(names)))
        states.show(UiState.EXIT)
