"""The keys of the brick. Source: docs/firmware.md sections 5.2 (Button and Ui map) and 8.5."""

from __future__ import annotations

from enum import IntEnum

from sim_backend.firmware.button import ENTER_BUTTON, EXIT_BUTTON, LEFT_BUTTON, RIGHT_BUTTON


class Key(IntEnum):
    """Button byte of the Ui map."""

    LEFT = 1
    ENTER = 2
    RIGHT = 3
    EXIT = 4


KEYS = (
    (EXIT_BUTTON, Key.EXIT),
    (ENTER_BUTTON, Key.ENTER),
    (RIGHT_BUTTON, Key.RIGHT),
    (LEFT_BUTTON, Key.LEFT),
)
"""Each button's number and its key; of several that are pressed the first one counts."""
