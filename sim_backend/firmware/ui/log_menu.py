"""The menus of the data log: values of sensors and motors are chosen, each with a port.

Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence

from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.data_log import MOTOR_PORTS, SENSOR_PORTS, VALUES, DataLog
from sim_backend.firmware.ui.key_states import Action, Pass
from sim_backend.firmware.ui.screen_marks import Marks
from sim_backend.firmware.ui.states import Place, UiState

DATA_LOG: Place = (2,)
"""Item of the main menu."""

_DONE = len(VALUES)
"""Item of the list of values that ends the choice."""

_MOTORS = (6, 7)

DONE = (*DATA_LOG, _DONE)
START = (*DONE, 0)
"""The only item of the page that starts the log, and the page after it."""

STORE = 1
"""Item of that page, besides the one that deletes the log."""
_KEPT = 2
"""Number of its items."""

_PORT_LEVEL = 3
"""Items that lead to a value's port: data log, value, port."""


class LogMenu:
    """The values that are chosen for the data log.

    Args:
        log: Runs with them.

    Attributes:
        log: As given.
        chosen: For each port that has a value, the item of that value; motors' ports follow those of sensors.
    """

    def __init__(self, log: DataLog) -> None:
        self.log = log
        self.chosen: dict[int, int] = {}

    def begin(self) -> bool:
        """Begin the log, and return whether that was possible."""
        return self.log.begin(self.chosen)

    def clear(self) -> None:
        """Begin without values."""
        self.chosen.clear()

    def items(self, menu: Place) -> int:
        """Return the number of items of a menu of the data log, 0 of another one."""
        if menu == START:
            return _KEPT
        if menu[:1] != DATA_LOG or len(menu) >= _PORT_LEVEL:
            return 0
        if menu == DATA_LOG:
            return _DONE + 1
        if menu == DONE:
            return 1
        return MOTOR_PORTS if menu[1] in _MOTORS else SENSOR_PORTS

    def follows(self, place: Place) -> bool:
        """Return whether enter does more in a place than to open a menu."""
        return place == DONE or (place[:1] == DATA_LOG and place[:2] != DONE and len(place) == _PORT_LEVEL)

    def refuses(self, place: Place) -> bool:
        """Return whether a port is chosen that has a value already."""
        return place != DONE and self._port(place) in self.chosen

    def _port(self, place: Place) -> int:
        return place[2] + SENSOR_PORTS * (place[1] in _MOTORS)

    def enter(self, place: Place) -> tuple[list[int], list[Pass]]:
        """Follow enter in such a place: return the place that it leads to, and the states from its drawing on."""
        end = Pass(UiState.MENU), Pass(UiState.DRAWING)
        enter = end[-1], Pass(UiState.DRAWING, marks.MENU), Pass(UiState.ENTER), end[0]
        if place == DONE:
            if self.chosen:
                return [*START], [*enter, Pass(UiState.DRAWING, marks.READY), end[-1]]
            return [*DATA_LOG], [*enter, end[-1], *end]
        if self.refuses(place):
            return [*place], [Pass(UiState.DRAWING, marks.REFUSES)]
        self.chosen[self._port(place)] = place[1]
        return [*DONE], [*enter, Pass(UiState.DRAWING, marks.TAKEN), Pass(UiState.EXIT), *end]

    def leave(self, message: Sequence[Marks], end: Action) -> tuple[list[int], list[Pass]]:
        """Leave the log, perhaps by a message: return the place that this leads to, and the passes.

        A log that runs is ended, and stored or deleted next; one that could not begin leads to the main menu.
        """
        drawn = [Pass(UiState.DRAWING, each) for each in message]
        menu = Pass(UiState.MENU), Pass(UiState.DRAWING, marks.MENU)
        if not self.log.runs:
            return [*DATA_LOG], [*drawn, *menu]
        last = drawn.pop() if drawn else Pass(UiState.DRAWING)
        return [*START, STORE], [*drawn, last._replace(action=end), Pass(UiState.RIGHT), *menu]
