"""The states of the user interface. Source: docs/firmware.md sections 5.2 (Ui map) and 8."""

from __future__ import annotations

from enum import Enum, IntEnum, auto
from typing import Protocol

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.ui.keys import Key

Place = tuple[int, ...]
"""A menu, or an item of one: the numbers of the items that lead there."""


class UiState(IntEnum):
    """State byte of the Ui map; the simulated states only."""

    START = 0
    EMPTY = 1
    LOGO = 2
    MELODY = 3
    ENTRY = 4
    MENU = 5
    DRAWING = 6
    WAITING = 7
    LEFT = 8
    RIGHT = 9
    ENTER = 10
    EXIT = 11
    QUESTION = 12
    OPENING = 13
    RUNNING = 14
    LOW_BATTERY = 15
    REPORT = 16


IN_MENU = (UiState.MENU, UiState.DRAWING, UiState.WAITING)

KEY_STATES: dict[int, UiState] = {key: UiState[key.name] for key in Key}
"""The state that a key brings, by its button byte."""
MENU_STATES = (UiState.MELODY, UiState.ENTRY, UiState.MENU, UiState.DRAWING, *KEY_STATES.values())
STARTED = (UiState.OPENING, UiState.RUNNING)
"""States in which a file is opened, runs, or its end is shown."""

LEAD_OFF = (UiState.MENU, UiState.DRAWING, UiState.LOGO, UiState.MELODY, *KEY_STATES.values())
"""States that do not keep the brick on while it switches itself off."""

RADIO_SHOWN = (UiState.QUESTION, UiState.REPORT)

PAUSING = (UiState.EMPTY, UiState.WAITING, UiState.LOW_BATTERY, *RADIO_SHOWN)
"""States that leave the page of a menu or a file, if they are written to the map, which can continue."""

GONE_ON_FROM = (UiState.START, UiState.LOGO, *MENU_STATES, UiState.OPENING, UiState.RUNNING)
"""States from which the menus continue if they are written to the map, and all such states."""

STATUS_WORK = int(UiFlag.UPDATE | UiFlag.REDRAW_STATUS)
"""Requests to draw the status bar: executed in the next pass, or kept while a program has the screen."""

RUNNING_FLAGS = int(UiFlag.DISABLE_LEFT_RIGHT_ENTER | UiFlag.DISABLE_EXIT)
"""Set while a program runs."""

PROGRAMS, SOUND, ON_BRICK, LOG, OLD_LOG = (".rxe", ".rtm"), ".rso", ".rpg", ".log", ".rdt"
"""Files that can be started. Programs made on the brick and logs do not run: the message after them is shown."""

KNOWN = (*PROGRAMS, SOUND, ON_BRICK)
"""Those of all versions; logs have another extension in 1.05."""

STARTING: dict[int, tuple[UiState, int]] = {
    UiState.LOGO: (UiState.MELODY, 897),
    UiState.MELODY: (UiState.ENTRY, 1),
    UiState.ENTRY: (UiState.MENU, 1),
    UiState.MENU: (UiState.DRAWING, 1),
    UiState.DRAWING: (UiState.WAITING, 1),
}
"""States of a start after the logo: the next one, and how long it lasts in ms."""


class Run(Enum):
    """Event that the state RUNNING waits for."""

    BEGUN = auto()
    TONE = auto()
    DRAWING = auto()
    TO_OPEN = auto()
    PROGRAM = auto()
    STEPS = auto()
    ENDED = auto()
    SOUND = auto()
    LOG = auto()
    MESSAGE = auto()
    PAGE = auto()


class Programs(Protocol):
    """The part of the command module that the user interface uses.

    Attributes:
        status: How the last program ended.
        sync_time: Time set for the data log.
        sync_tick: The brick's time at that moment.
    """

    status: int
    sync_time: int
    sync_tick: int

    @property
    def tick(self) -> int:
        """The brick's time."""

    @property
    def active(self) -> bool:
        """Whether a program is active."""

    @property
    def busy(self) -> bool:
        """Whether a program is active, or was to start in this pass."""

    @property
    def running(self) -> bool:
        """Whether it has not ended, either."""

    def start(self, name: bytes) -> None:
        """Start a program in the next pass."""

    def stop(self) -> None:
        """Stop the program in the next pass."""

    def reset(self) -> None:
        """Forget the last program in the next pass."""
