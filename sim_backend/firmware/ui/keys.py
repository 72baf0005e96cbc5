"""The keys of the brick. Source: docs/firmware.md sections 5.2 (Button and Ui map) and 8.5."""

from __future__ import annotations

from enum import IntEnum


class Key(IntEnum):
    """Button byte of the Ui map."""

    LEFT = 1
    ENTER = 2
    RIGHT = 3
    EXIT = 4


EXIT, ENTER = 0, 3
"""Numbers of these buttons in the button module."""

KEYS = ((EXIT, Key.EXIT), (ENTER, Key.ENTER), (1, Key.RIGHT), (2, Key.LEFT))
"""Numbers of the button module and their keys; of several keys the first one counts."""
