"""The state machine of a link, without I/O, threads or a clock: what is due when, and what a loss means.

Rule 1: everything that decides about a loss, a reconnection or a timer stands here. Rule 2: nothing here sends, waits
or reads a clock; times are arguments, on the link's clock. So the same core serves a link that leads to real hardware,
where a thread asks for work at its time, and a simulated one, where the program's own waiting does.

::

    OPEN ──lose()──> LOST ──begin_attempt()──> REOPENING ──reopened()──> OPEN
                      ^                            │
                      └────────attempt_failed()────┘          any ──close()──> CLOSED
"""

from __future__ import annotations

import logging
import math
import threading
from enum import Enum

from firmware_protocol.dialogue import Dialogue
from firmware_protocol.direct import (
    GetBatteryLevel,
    GetCurrentProgramName,
    GetInputValues,
    GetOutputState,
    GetProperty,
    KeepAlive,
    SetInputMode,
)
from firmware_protocol.enums import InputPort
from firmware_protocol.errors import LinkLost
from firmware_protocol.system import GetBluetoothAddress, GetDeviceInfo, GetVersions, IOMapRead
from nxtdrive.link.timers import Timers

FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 2.0
"""The pause between two attempts to reconnect doubles, from the first to the longest."""

IDEMPOTENT = (
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
"""Commands that may be sent again after a loss: the second time changes nothing."""

log = logging.getLogger(__name__)


class LinkState(Enum):
    """Where a link is between opened and closed."""

    OPEN = "open"
    LOST = "lost"
    REOPENING = "reopening"
    CLOSED = "closed"


class Interrupted(LinkLost):
    """The link was lost and is back; motors were driven before, and their motion is over."""


class LinkCore:
    """The state of one link. Its methods may be called from several threads; none of them blocks.

    Attributes:
        state: Where it is between opened and closed.
        dialogue: Which reply belongs to which request; only for the holder of the link's lock.
        timers: Telegrams that go out at their time.
        steps_due: When the next step of a motion is due; infinity without any.
        attempt_due: When to try again to reopen a lost link; infinity while there is nothing to try.
        driven: Whether motors were driven since the last loss the program knows of.
        interrupted: Whether motors were driven when the link was lost, and the program does not know yet.
        modes: Input ports that are set again after a reconnection.
        untold: What the link was lost by, if it does not reconnect and the program does not know yet.
    """

    def __init__(self) -> None:
        self.state = LinkState.OPEN
        self.dialogue = Dialogue()
        self.timers = Timers()
        self.steps_due = math.inf
        self.attempt_due = math.inf
        self.driven = False
        self.interrupted = False
        self.modes: dict[InputPort, SetInputMode] = {}
        self.untold: LinkLost | None = None
        self._pause_s = FIRST_PAUSE_S
        self._lock = threading.Lock()

    @property
    def due(self) -> float:
        """When there is work next: a telegram, a step of a motion, or an attempt to reconnect."""
        if self.state is LinkState.OPEN:
            return min(self.timers.due, self.steps_due)
        return min(self.steps_due, self.attempt_due)

    def lose(self, lost: LinkLost, now: float, *, reconnecting: bool) -> None:
        """Take in that the link is lost; only the first of those who find out makes a difference."""
        with self._lock:
            if self.state is not LinkState.OPEN:
                return
            self.state = LinkState.LOST
            self.untold = None if reconnecting else lost
            self.interrupted = reconnecting and self.driven
            self._pause_s = FIRST_PAUSE_S
            self.attempt_due = now + FIRST_PAUSE_S if reconnecting else math.inf
        if reconnecting:
            log.warning("%s The link is opened again when the brick is back.", lost.args[0])

    def begin_attempt(self, now: float = math.inf) -> bool:
        """Whether to try to reopen the link now; the caller then reports `reopened` or `attempt_failed`.

        Args:
            now: Without it the program itself wants to try, whatever the time.
        """
        with self._lock:
            waiting = self.state is LinkState.LOST and now >= self.attempt_due
            if waiting or (math.isinf(now) and self.state is LinkState.OPEN):
                self.state = LinkState.REOPENING
                return True
            return False

    def attempt_failed(self, error: BaseException, now: float) -> None:
        """Take in that the link could not be reopened; the pause before the next attempt doubles."""
        log.debug("the link is not back yet: %s", error)
        with self._lock:
            if self.state is LinkState.REOPENING:
                self.state = LinkState.LOST
            if math.isfinite(self.attempt_due):
                self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
                self.attempt_due = now + self._pause_s

    def reopened(self, address: str) -> None:
        """Take in that the link is open again, in every respect."""
        with self._lock:
            if self.state is not LinkState.REOPENING:
                return
            self.state = LinkState.OPEN
            self.attempt_due = math.inf
        log.info("the link to %s is back", address)

    def close(self) -> None:
        """End the link for good."""
        with self._lock:
            self.state = LinkState.CLOSED
            self.attempt_due = math.inf

    def acknowledge(self) -> None:
        """Take in that the program knows of the loss and that its motors have stopped."""
        self.interrupted = self.driven = False
        self.untold = None
