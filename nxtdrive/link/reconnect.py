"""Reopening a lost link, and reporting the loss to the program."""

from __future__ import annotations

import math
import threading
from typing import Any, Protocol

from firmware_protocol.errors import Interrupted, LinkLost
from firmware_protocol.telegram import Command
from nxtdrive.link.core import IDEMPOTENT, LinkCore, LinkState
from nxtdrive.link.priority_lock import PriorityLock
from nxtdrive.transports import reopen_transport
from nxtdrive.transports.base import Transport, closed

RECONNECT_TIMEOUT_S = 30.0
"""How long a request waits for a lost link; a brick that was switched off and on answers over USB within 10 s."""

PROBE_S = 2.0
"""How often a link that reconnects is probed for a loss."""


class ReopenableLink(Protocol):
    """What reopening needs of `nxtdrive.link.link.Link`, which imports this module."""

    transport: Transport
    timeout_s: float
    reconnecting: bool

    @property
    def acts_for_program(self) -> bool:
        """Whether the calling thread acts for the program, not for a motion or the link."""
        ...

    def now(self) -> float:
        """Return the time on the link's clock."""
        ...

    def keep_alive(self) -> None:
        """Keep the brick awake from now on."""
        ...

    def use(self, transport: Transport) -> None:
        """Switch to another transport."""
        ...

    def pause(self, duration_s: float) -> None:
        """Wait, at most `duration_s`."""
        ...

    def wake(self) -> None:
        """Have the schedule checked."""
        ...


class Reconnector:
    """Handles the losses of one link; their state is in the core.

    Args:
        link: The link.
        core: Its state.
        lock: Its lock, held during each request.
    """

    def __init__(self, link: ReopenableLink, core: LinkCore, lock: PriorityLock) -> None:
        self._link = link
        self._core = core
        self._lock = lock
        self._attempting = 0

    def report(self) -> None:
        """Report a loss that another thread has noticed to the program, once.

        Raises:
            Interrupted: The link is back, but motors were driven. Raised in steps of motions too, without counting as
                reported.
            LinkLost: It is lost and does not reconnect.
        """
        core, program = self._core, self._link.acts_for_program
        if core.state is LinkState.OPEN and core.interrupted:
            if program:
                core.acknowledge()
            raise interrupted()
        # each request comes here, so the lock is taken only if there is something to report
        if program and core.unreported is not None and (lost := core.take_unreported()) is not None:
            raise lost

    def check(self) -> None:
        """Check that a request may be sent: `report` losses, and leave alone a link that is about to be reopened.

        Raises:
            LinkLost: The link is lost; or see `report`.
        """
        self.report()
        core = self._core
        if core.reconnecting and core.state in (LinkState.LOST, LinkState.REOPENING) and not self._reopens:
            raise LinkLost("the link is lost, and not open again yet.", remedy="Is the brick on?")

    def lose(self, lost: LinkLost) -> None:
        """Record that the link is lost.

        Raises:
            LinkLost: It does not reconnect, or this thread is reopening it.
        """
        core, link = self._core, self._link
        if not self._reopens:
            core.lose(lost, link.now())
        if self._reopens or not core.reconnecting or core.state is LinkState.CLOSED:
            if link.acts_for_program:
                core.take_unreported()
            raise lost
        link.wake()

    def recover(self, lost: LinkLost, timeout_s: float, command: Command[Any], since_s: float = math.inf) -> None:
        """Wait until the lost link is open again and `command` may be sent again; arguments as in `await_reconnect`.

        Raises:
            LinkLost: It does not reconnect, or not in time; or it is open again, but only the program can decide how to
                continue. Motions are not kept waiting.
        """
        if isinstance(lost, Interrupted):
            raise lost
        self.lose(lost)
        if not self._link.acts_for_program:
            raise lost
        if self.await_reconnect(lost, timeout_s, since_s) or not isinstance(command, IDEMPOTENT):
            raise interrupted(command) from lost

    def await_reconnect(self, lost: LinkLost, timeout_s: float, since_s: float = math.inf) -> bool:
        """Wait until the link is open again; this counts as reporting the loss to the program.

        Args:
            lost: The loss.
            timeout_s: Longest wait.
            since_s: When the wait began, on the link's clock; now at the latest.

        Returns:
            Whether motors were driven when it was lost.

        Raises:
            LinkLost: It was closed, or is not open after `timeout_s`.
        """
        core, link = self._core, self._link
        deadline = min(since_s, link.now()) + timeout_s
        while core.state is not LinkState.OPEN:
            if core.state is LinkState.CLOSED:
                raise lost
            left = deadline - link.now()
            if left <= 0:
                core.acknowledge()
                waited = f"did not come back within {timeout_s:g} s" if timeout_s else "is not back yet"
                failure = core.last_failure
                remedy = f"The last attempt to reopen it failed: {failure}" if failure else "Is it on?"
                raise LinkLost(f"the link is lost, and the brick {waited}.", remedy=remedy) from lost
            link.pause(left)
        driven = core.interrupted
        core.acknowledge()
        return driven

    @property
    def _reopens(self) -> bool:
        """Whether the calling thread is reopening the link."""
        return self._attempting == threading.get_ident()

    def after_motion(self, lost: LinkLost, timeout_s: float) -> None:
        """Wait until the link is open again after a motion could not begin; the program has to begin it again.

        Raises:
            Interrupted: The link is open again.
            LinkLost: It does not reconnect, or see `await_reconnect`.
        """
        if not self._core.reconnecting:
            raise lost
        self.await_reconnect(lost, timeout_s)
        raise interrupted() from lost

    def reconnect(self, timeout_s: float) -> None:
        """Reopen the link on the program's request; if another thread is already doing so, wait for it."""
        if self._core.begin_attempt():
            self._core.acknowledge()
            self.reopen()
        else:
            self.await_reconnect(closed(self._link.transport.address), timeout_s)

    def reopen(self) -> None:
        """Reopen the link: same address, same brick. The core has begun the attempt.

        Raises:
            NXTError: The brick is not back, or cannot be opened.
        """
        core, link = self._core, self._link
        self._attempting = threading.get_ident()
        try:
            self._lock.exclusive(link.transport.close)  # not during a request; opening needs no lock
            transport = reopen_transport(link.transport, timeout_s=link.timeout_s)
            try:
                self._lock.exclusive(self._use, transport)
            except BaseException:  # closed meanwhile, or Ctrl-C
                if link.transport is not transport:
                    transport.close()
                raise
            link.reconnecting = core.reconnecting  # probes again
            link.keep_alive()
            core.reopened(transport.address)
        except BaseException as error:
            core.attempt_failed(error, link.now())
            raise
        finally:
            self._attempting = 0
            link.wake()

    def _use(self, transport: Transport) -> None:
        """Switch to a transport that was opened again; the caller holds the lock."""
        if self._core.state is LinkState.CLOSED:
            raise closed(transport.address)
        self._link.use(transport)
        self._core.dialogue.reset()
        self._core.timers.clear()


def interrupted(command: Command[Any] | None = None) -> Interrupted:
    """Make the error that leaves the decision to the program: a motion or `command` was under way at the loss."""
    what = "a motion was under way" if command is None else f"{type(command).__name__} was not repeated"
    return Interrupted(f"the link was lost and is back, but {what}.", remedy="Begin it again; motors have stopped.")
