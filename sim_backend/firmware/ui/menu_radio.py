"""The pages of the radio's menu: contacts, connections, visibility, switch, search.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from functools import partial

from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_answers import RadioState
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import menu_places as places
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.key_states import KeyStates, Pass
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.screen_marks import NOTHING
from sim_backend.firmware.ui.states import Place, UiState

_VISIBLE_MS = 5
"""Passes in which the radio becomes visible or not; the state changes in the last but one."""

_READS_KEYS_MS = 6
"""Passes of a search that read keys, before its message."""


class MenuRadio:
    """Changes the radio, with the states of a key that show it.

    Args:
        keys: Can abort a search.
        radio: The radio.
        states: Shows it.
    """

    def __init__(self, keys: KeyInput, radio: Radio, states: KeyStates) -> None:
        self._keys, self._radio, self._states = keys, radio, states

    def first(self, page: Place) -> int:
        """Return the item that a page of the radio begins with."""
        return places.SWITCH[-1] if page == places.RADIO and self._radio.shows_off else 0

    def follows(self, place: Place) -> bool:
        """Return whether enter does more in a place than to open a page."""
        pages = places.CONNECTIONS, places.VISIBILITY, places.SWITCH
        return place in (places.CONTACTS, places.SEARCH) or place[:-1] in pages

    def enter(self, place: Place) -> list[int]:
        """Follow enter in such a place; return the place that it leads to."""
        page, item, states = place[:-1], place[-1], self._states
        if page == places.VISIBILITY:
            shows = partial(self._show, visible=not item)
            states.draw_last(*[NOTHING] * _VISIBLE_MS, actions={_VISIBLE_MS - 2: shows})
        elif page == places.SWITCH:
            states.draw_last(*self._switch(on=not item or self._radio.shows_off))
            page = page[:-1]
        elif place == places.SEARCH:
            states.draw_last(*drawing.SEARCHED)
            states.add(UiState.DRAWING)
            reads = {at: partial(self._read_key, len(drawing.FOUND_NONE) - at - 1) for at in range(_READS_KEYS_MS)}
            states.draw_last(*drawing.FOUND_NONE, actions=reads)
            page = place
        elif place == places.CONTACTS:
            states.draw_last(marks.MENU)
            states.show(UiState.ENTER)
            states.draw_last(marks.MENU, NOTHING)
            page = place
        states.show(UiState.EXIT)
        if page == places.CONNECTIONS:
            states.draw_last(marks.MENU, drawing.CONNECTIONS[0])
            page = place
        return [*page]

    def _read_key(self, left: int) -> None:
        """Take a key; exit aborts the search, of which some passes are left."""
        if self._keys.read_silently() == Key.EXIT:
            self._states.left[:left] = [Pass(UiState.DRAWING, each) for each in drawing.ABORTED[1:]]

    def _show(self, *, visible: bool) -> None:
        """Make the radio visible to others, or not."""
        self._radio.state = self._radio.state & ~int(RadioState.VISIBLE) | visible

    def _switch(self, *, on: bool) -> list[marks.Marks]:
        """Switch the radio in the next pass, and return the message about that."""
        if on != self._radio.shows_off:
            return drawing.SWITCHED
        self._states.act(partial(self._radio.switch, on, lead_ms=1))
        return drawing.SWITCHED_ON if on else drawing.SWITCHED_OFF
