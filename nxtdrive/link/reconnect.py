"""The way back to a brick whose link was lost: when to try again, and what the program is told."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from firmware_protocol.direct import (
    GetBatteryLevel,
    GetCurrentProgramName,
    GetInputValues,
    GetOutputState,
    GetProperty,
    KeepAlive,
    SetInputMode,
)
from firmware_protocol.errors import LinkLost, NXTError
from firmware_protocol.system import GetBluetoothAddress, GetDeviceInfo, GetVersions, IOMapRead

if TYPE_CHECKING:
    from firmware_protocol.telegram import Command

FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 2.0
"""Between attempts to open a lost link again the pause doubles, from the first to the longest."""
PATIENCE_S = 30.0
"""So long a request waits for a lost link; a brick that was switched off and on answers over USB within 10 s."""
PROBE_S = 2.0
"""How often a link that shall be opened again by itself is tried out while nothing else is said."""

QUESTIONS = (
    GetOutputState,
    GetInputValues,
    GetBatteryLevel,
    GetCurrentProgramName,
    GetProperty,
    GetVersions,
    GetDeviceInfo,
    GetBluetoothAddress,
    IOMapRead,
    KeepAlive,
    SetInputMode,
)
"""Commands that may be asked again after a loss, as asking twice is like asking once."""

log = logging.getLogger(__name__)


class Interrupted(LinkLost):
    """The link was lost and is back; motors were driven before, and their motion is over."""


class Reconnector:
    """A lost link's way back. One thread tries at a time.

    Args:
        now: The link's clock.
        reopen: Opens the link again, and calls `end`.

    Attributes:
        lost: What the link was lost by; None while it is there.
        due: When to try again, on the link's clock; infinity while it is there.
    """

    def __init__(self, now: Callable[[], float], reopen: Callable[[], None]) -> None:
        self.lost: LinkLost | None = None
        self.due = math.inf
        self._now, self._reopen = now, reopen
        self._pause_s = FIRST_PAUSE_S
        self._lock = threading.RLock()
        self._trying = 0

    @property
    def mine(self) -> bool:
        """Whether the calling thread is at an attempt."""
        return self._trying == threading.get_ident()

    def begin(self, lost: LinkLost, is_news: Callable[[], bool]) -> None:
        """Note that the link is lost, if `is_news` still says so once nobody is at an attempt."""
        with self._lock:
            if self.lost is None and is_news():
                log.warning("%s The link is opened again when the brick is back.", lost.args[0])
                self.lost, self._pause_s = lost, FIRST_PAUSE_S
                self.due = self._now() + self._pause_s

    def attempt(self) -> None:
        """Try to open the link again, if it is time."""
        with self._lock:
            if self.lost is None or self._now() < self.due:
                return
            self._trying = threading.get_ident()
            try:
                self._reopen()
            except NXTError as error:
                log.debug("the link is not back yet: %s", error)
                self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
                self.due = self._now() + self._pause_s
            finally:
                self._trying = 0

    def end(self, address: str) -> None:
        """Note that the link is there."""
        if self.lost is not None:
            log.info("the link to %s is back", address)
        self.lost, self.due = None, math.inf


def interrupted(command: Command[Any] | None = None) -> Interrupted:
    """The error for a program that must decide itself how to go on: a motion was under way, or `command` was."""
    what = "a motion was under way" if command is None else f"{type(command).__name__} was not repeated"
    return Interrupted(f"the link was lost and is back, but {what}.", remedy="Motors have stopped; start them again.")
