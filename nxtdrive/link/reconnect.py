"""Reopening a lost link, and what the program is told of the loss."""

from __future__ import annotations

import threading
from contextlib import AbstractContextManager
from typing import Any, Protocol, TypeVar

from firmware_protocol.direct import GetInputValues
from firmware_protocol.errors import LinkLost
from firmware_protocol.telegram import Command, Reply
from nxtdrive.link.core import IDEMPOTENT, Interrupted, LinkCore, LinkState
from nxtdrive.transports import reopen_transport
from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)


class LosableLink(Protocol):
    """What reopening needs of a link; see `nxtdrive.link.link.Link`."""

    transport: Transport
    timeout_s: float
    reconnecting: bool

    @property
    def acts_for_program(self) -> bool:
        """Whether the calling thread acts for the program, not for a motion or the link."""
        ...

    def now(self) -> float:
        """The link's clock."""
        ...

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Send a command and return its reply."""
        ...

    def keep_alive(self) -> None:
        """Keep the brick awake from now on."""
        ...

    def use(self, transport: Transport) -> None:
        """Go on over another transport."""
        ...

    def exclusive(self) -> AbstractContextManager[None]:
        """Hold the wire for a block."""
        ...

    def pause(self, duration_s: float) -> None:
        """Let some time pass, at most so much."""
        ...

    def announce(self) -> None:
        """Look at what is due."""
        ...


class Reconnector:
    """Handles the losses of one link; its state is the core's.

    Args:
        link: The link.
        core: Its state.

    Attributes:
        wished: Whether the link is opened again by itself.
    """

    def __init__(self, link: LosableLink, core: LinkCore) -> None:
        self.wished = False
        self._link = link
        self._core = core
        self._attempting = 0

    def check(self) -> None:
        """Tell the program of a loss that another thread has met, once.

        Raises:
            Interrupted: The link is back, but motors were driven. A step of a motion is told, too, but does not count.
            LinkLost: It is lost and does not reconnect.
        """
        core, program = self._core, self._link.acts_for_program
        if core.state is LinkState.OPEN and core.interrupted:
            if program:
                core.acknowledge()
            raise interrupted()
        if core.untold is not None and program:
            lost, core.untold = core.untold, None
            raise lost

    def lose(self, lost: LinkLost) -> None:
        """Take in that the link is lost.

        Raises:
            LinkLost: It does not reconnect.
        """
        core, link = self._core, self._link
        attempting = self._attempting == threading.get_ident()
        if not attempting and core.state is not LinkState.CLOSED:
            core.lose(lost, link.now(), reconnecting=self.wished)
        core.dialogue.reset()
        if attempting or not self.wished:
            if link.acts_for_program:
                core.untold = None
            raise lost
        link.announce()

    def outlast(self, lost: LinkLost, timeout_s: float, command: Command[Any]) -> None:
        """Wait until the lost link is open again and `command` may be sent again.

        Raises:
            LinkLost: It does not reconnect, or not in time; or it is open again, but the program has to decide itself
                how to go on.
        """
        if isinstance(lost, Interrupted):
            raise lost
        self.lose(lost)
        core, link = self._core, self._link
        if not link.acts_for_program:
            raise lost
        deadline = link.now() + timeout_s
        while core.state is not LinkState.OPEN:
            left = deadline - link.now()
            if left <= 0 or core.state is LinkState.CLOSED:
                core.acknowledge()
                waited = f"did not come back within {timeout_s:g} s" if timeout_s else "is not back yet"
                raise LinkLost(f"the link is lost, and the brick {waited}.", remedy="Is it on?") from lost
            link.pause(left)
        driven = core.interrupted
        core.acknowledge()
        if driven or not isinstance(command, IDEMPOTENT):
            raise interrupted(command) from lost

    def reopen(self) -> None:
        """Open the link again: same address, same brick, input ports in the same modes. The core has begun the attempt.

        Raises:
            NXTError: It is not back, or cannot be opened.
        """
        core, link = self._core, self._link
        self._attempting = threading.get_ident()
        try:
            with link.exclusive():
                link.transport.close()  # not amid a request; opening it takes long, and needs no lock
            transport = reopen_transport(link.transport, timeout_s=link.timeout_s)
            with link.exclusive():
                if core.state is LinkState.CLOSED:
                    transport.close()
                    raise LinkLost(f"{transport.address} is closed.", remedy="Open the brick again.")
                link.use(transport)
                core.dialogue.reset()
                core.timers.clear()
            link.reconnecting = self.wished  # probes again
            link.keep_alive()
            for port, mode in list(core.modes.items()):
                values = link.request(GetInputValues(port))
                if (values.type, values.mode) != (mode.type, mode.mode):
                    link.request(mode)
            core.reopened(transport.address)
        except BaseException as error:
            core.attempt_failed(error, link.now())
            raise
        finally:
            self._attempting = 0
            link.announce()


def interrupted(command: Command[Any] | None = None) -> Interrupted:
    """The error for a program that must decide itself how to go on: a motion was under way, or `command` was."""
    what = "a motion was under way" if command is None else f"{type(command).__name__} was not repeated"
    return Interrupted(f"the link was lost and is back, but {what}.", remedy="Motors have stopped; start them again.")
