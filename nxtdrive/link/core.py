"""The state machine of a link, without I/O, threads or a clock.

It schedules the work of a link and tracks losses; it never sends, waits or reads a clock. Callers pass the time on
the link's clock. So one core serves both real links, where a thread does the scheduled work, and simulated ones, where
the program does it whenever it waits.

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
"""Commands that may be sent again after a loss: repeating them changes nothing."""

log = logging.getLogger(__name__)


class LinkState(Enum):
    """State of a link, see the diagram above."""

    OPEN = "open"
    LOST = "lost"
    REOPENING = "reopening"
    CLOSED = "closed"


class LinkCore:
    """The state of one link. Its methods may be called from several threads; none of them blocks.

    Attributes:
        state: Whether the link is open, lost, being reopened or closed.
        reconnecting: Whether a lost link is reopened automatically.
        dialogue: Matches replies to requests; only the holder of the link's lock may use it.
        timers: Telegrams to send at set times.
        steps_due: When the next step of a motion is due; infinity if there is none.
        attempt_due: When to try to reopen a lost link; infinity if no attempt is planned.
        motors_driven: Whether motors were driven since the last loss that was reported to the program.
        interrupted: Whether motors were driven when the link was lost, and this is not reported to the program yet.
        last_failure: Message of the last failed attempt since the loss; empty before one.
        unreported: The loss of a link that does not reconnect, until it is reported to the program.
    """

    def __init__(self) -> None:
        self.state = LinkState.OPEN
        self.reconnecting = False
        self.dialogue = Dialogue()
        self.timers = Timers()
        self.steps_due = math.inf
        self.attempt_due = math.inf
        self.motors_driven = False
        self.interrupted = False
        self.unreported: LinkLost | None = None
        self.last_failure = ""
        self._pause_s = FIRST_PAUSE_S
        self._lock = threading.Lock()

    @property
    def due(self) -> float:
        """When there is work next: a telegram, a step of a motion, or an attempt to reconnect."""
        if self.state is LinkState.OPEN:
            return min(self.timers.due, self.steps_due)
        if self.state is LinkState.LOST:
            return min(self.attempt_due, self.steps_due)
        return self.steps_due

    def set_reconnecting(self, enabled: bool, now: float) -> None:
        """Choose whether a lost link is reopened automatically; this also applies to one that is lost already."""
        with self._lock:
            self.reconnecting = enabled
            if self.state in (LinkState.LOST, LinkState.REOPENING):
                self.attempt_due = min(self.attempt_due, now + FIRST_PAUSE_S) if enabled else math.inf

    def lose(self, lost: LinkLost, now: float) -> None:
        """Record that the link is lost; has no effect unless the link was open."""
        with self._lock:
            if self.state is not LinkState.OPEN:
                return
            self.state = LinkState.LOST
            self._pause_s = FIRST_PAUSE_S
            self.last_failure = ""
            if self.reconnecting:
                self.interrupted, self.attempt_due = self.motors_driven, now + FIRST_PAUSE_S
            else:
                self.unreported = lost
        if self.reconnecting:
            log.warning("%s The link is reopened when the brick is back.", lost.args[0])

    def begin_attempt(self, now: float = math.inf) -> bool:
        """Begin an attempt to reopen the link, if it is time; the caller then reports `reopened` or `attempt_failed`.

        Args:
            now: Time on the link's clock. Infinity stands for an attempt on the program's request: it is always time,
                and the link need not be known to be lost.

        Returns:
            Whether the attempt has begun.
        """
        with self._lock:
            waiting = self.state is LinkState.LOST and now >= self.attempt_due
            if waiting or (math.isinf(now) and self.state is LinkState.OPEN):
                self.state = LinkState.REOPENING
                return True
            return False

    def attempt_failed(self, error: BaseException, now: float) -> None:
        """Record that the link could not be reopened; the pause before the next attempt doubles."""
        log.debug("the link is not back yet: %s", error)
        with self._lock:
            if self.state is not LinkState.REOPENING:
                return
            self.state = LinkState.LOST
            self.last_failure = str(error)
            if self.reconnecting:
                self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
                self.attempt_due = now + self._pause_s

    def reopened(self, address: str) -> None:
        """Record that the link is open again."""
        with self._lock:
            if self.state is not LinkState.REOPENING:
                return
            self.state = LinkState.OPEN
            self.attempt_due = math.inf
        log.info("the link to %s is back", address)

    def close(self) -> None:
        """Close the link permanently."""
        with self._lock:
            self.state = LinkState.CLOSED
            self.attempt_due = math.inf

    def take_unreported(self) -> LinkLost | None:
        """Return the loss that is not reported to the program yet; from now on it counts as reported."""
        with self._lock:
            lost, self.unreported = self.unreported, None
            return lost

    def acknowledge(self) -> None:
        """Record that the loss was reported to the program and that its motors have stopped."""
        with self._lock:
            self.interrupted = self.motors_driven = False
            self.unreported = None
