"""The states of the user interface. Source: docs/firmware.md sections 5.2 (Ui map) and 8."""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol

from firmware_protocol.iomap import UiFlag
from sim_backend.firmware.ui.keys import Key


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


KEY_STATES: dict[int, UiState] = {key: UiState[key.name] for key in Key}
"""The state that a key brings, by its button byte."""
STATUS_WORK = int(UiFlag.UPDATE | UiFlag.REDRAW_STATUS)
"""Requests to draw the status bar: executed in the next pass, or kept while a program has the screen."""

RUNNING_FLAGS = int(UiFlag.DISABLE_LEFT_RIGHT_ENTER | UiFlag.DISABLE_EXIT)
"""Set while a program runs."""

FILE_TYPES = (".*", ".rso", ".rxe", ".rpg", ".rtm")
"""The extension of each kind of files as the menus number them: all, and others; data logs, which differ by version,
follow."""


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
