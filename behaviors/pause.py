"""An operator's pause of a mission, after which it continues where it left off, and an operator's end of it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from behaviors.ports import Outage


class Paused(Outage):
    """Raised when the operator has paused the mission; interrupts a skill as an outage does."""


class Pause:
    """A pause that any thread requests and ends, during which the mission's thread waits.

    A motion under way is aborted where `check` is called, such as before each request; skills call it before each
    bounded piece of work.

    Attributes:
        ended: Whether the mission is to end.
    """

    def __init__(self) -> None:
        self.ended = False
        self._resumed = threading.Event()
        self._resumed.set()
        self._armed = False

    @property
    def wanted(self) -> bool:
        """Whether the mission is to pause; one that is to end is not."""
        return not self.ended and not self._resumed.is_set()

    def request(self) -> None:
        """Pause the mission, unless it is to end."""
        if not self.ended:
            self._resumed.clear()

    def resume(self) -> None:
        """Let the mission continue."""
        self._resumed.set()

    def end(self) -> None:
        """End the mission, paused or not, as Ctrl-C does."""
        self.ended = True
        self._resumed.set()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end of the pause, for at most `timeout_s` of real time; returns whether it has ended."""
        return self._resumed.wait(timeout_s)

    @contextmanager
    def interrupting(self) -> Iterator[None]:
        """Let `check` abort the block.

        Raises:
            Paused: The mission is to pause.
            KeyboardInterrupt: It is to end.
        """
        self._armed = True
        try:
            self.check()
            yield
        finally:
            self._armed = False

    def check(self) -> None:
        """Abort the active skill; call it where that is safe, such as before each request to the robot.

        Raises:
            Paused: The mission is to pause; raised once, so that cleanup may use the robot.
            KeyboardInterrupt: It is to end; likewise.
        """
        if self._armed and (self.ended or self.wanted):
            self._armed = False
            self.check_end()
            raise Paused("paused")

    def check_end(self) -> None:
        """Abort the mission if it is to end.

        Raises:
            KeyboardInterrupt: It is to end.
        """
        if self.ended:
            raise KeyboardInterrupt
