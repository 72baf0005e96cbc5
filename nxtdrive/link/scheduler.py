"""Run motions side by side, a step at a time, whether or not the program waits for them.

A motion is a generator: it makes its requests and yields the time, on the link's clock, of its next step. The link runs
the steps in its thread, or in the simulator whenever the program lets time pass.
"""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Generator, Iterable
from contextlib import AbstractContextManager, nullcontext
from types import TracebackType
from typing import Any, Generic, Protocol, TypeVar

from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkLost, LocalProtocolError
from nxtdrive.link.threads import Lock
from nxtdrive.transports.base import Transport

R = TypeVar("R")
Steps = Generator[float, None, R]
"""A motion: yields the times of its next steps on the link's clock, and returns its outcome."""

STEP_S = 0.001
"""Shortest wait: one step of the simulator's clock."""
RESOLUTION_S = STEP_S / 2
"""Work due within this time is due now. Half a step of the simulator's clock, as sums of fractions are not exact."""

log = logging.getLogger(__name__)


class Cancelled(Exception):
    """Thrown into a motion to end it; the motion brakes its motors and returns its outcome.

    Attributes:
        replaced: Whether another command to one of its motors follows.
    """

    def __init__(self, *, replaced: bool = False) -> None:
        super().__init__()
        self.replaced = replaced


class Motion(Generic[R]):
    """A motion, in progress or over.

    Attributes:
        ports: Its motors.
        transport: The transport it began on; a motion does not survive a reconnection.
        due: When its next step is due, on the link's clock; infinity when it is over.
        ended: Set when it is over.
    """

    def __init__(
        self, scheduler: MotionScheduler, link: SchedulingLink, ports: frozenset[OutputPort], steps: Steps[R]
    ) -> None:
        self.ports = ports
        self.transport = link.transport
        self.due = math.inf
        self.ended = threading.Event()
        self._scheduler, self._link = scheduler, link
        self._steps = steps
        self._outcome: R | None = None
        self._error: BaseException | None = None
        self._traceback: TracebackType | None = None

    @property
    def done(self) -> bool:
        """Whether it is over, successfully or not."""
        return self.ended.is_set()

    def join(self) -> R:
        """Wait until it is over; an exception while waiting, such as Ctrl-C, cancels it.

        Returns:
            Its outcome.

        Raises:
            NXTError: The error that ended it; the motors were braked if the brick could be reached.
        """
        try:
            while not self.done:
                self._link.wait_for(self)
        except BaseException:
            self.cancel()
            raise
        if self._error is not None:
            if isinstance(self._error, LinkLost):
                self._link.acknowledge()
            raise self._error.with_traceback(self._traceback)  # the traceback as it ended; each `join` would add to it
        return self._outcome  # type: ignore[return-value]  # without an error there is an outcome

    def cancel(self) -> None:
        """End it and brake its motors; has no effect if it is over."""
        self._scheduler.end(self, Cancelled())

    def advance(self, reason: BaseException | None = None) -> None:
        """Run the next step, or end the motion for `reason`; only for the scheduler.

        Raises:
            BaseException: An interrupt such as Ctrl-C ended the step and with it the motion.
        """
        try:
            self.due = next(self._steps) if reason is None else self._steps.throw(reason)
        except StopIteration as end:
            self._end(end.value, None)
        except Exception as error:  # noqa: BLE001 - whatever it is, `join` raises it
            self._end(None, error)
        except BaseException as error:
            self._end(None, error)
            raise

    def _end(self, outcome: R | None, error: BaseException | None) -> None:
        if error is not None:
            log.info("a motion of %s ended: %s", ", ".join(port.name for port in self.ports), error)
            self._traceback = error.__traceback__
        self._outcome, self._error, self.due = outcome, error, math.inf
        self.ended.set()


class SchedulingLink(Protocol):
    """What the scheduler needs of `nxtdrive.link.link.Link`, which imports this module.

    Attributes:
        transport: The transport in use; replaced on reconnection.
    """

    transport: Transport

    @property
    def lost(self) -> bool:
        """Whether the link is known to be lost and will be reopened."""
        ...

    def now(self) -> float:
        """Return the time on the link's clock."""
        ...

    def schedule(self, due: float) -> None:
        """Run the next step at `due`."""
        ...

    def wake(self) -> None:
        """Have the schedule checked."""
        ...

    def wait_for(self, motion: Motion[Any]) -> None:
        """Wait until a motion may have advanced."""
        ...

    def after_motion(self, lost: LinkLost) -> None:
        """Wait until a link that was lost in a motion's first step is open again; always raises."""
        ...

    def acknowledge(self) -> None:
        """Record that a loss was reported to the program."""
        ...


class MotionScheduler:
    """The motions of a link; each motor takes part in at most one.

    Args:
        link: The link; its clock is used, and its loss ends all motions.
        lock: A reentrant lock, held during each step.
        entry: Another one, held by a command that waits for `lock`; the next step lets it go first. Without it, the
            link's thread could keep a stop waiting for ever on a slow link, on which a step is always due.
    """

    def __init__(self, link: SchedulingLink, lock: Lock, entry: Lock) -> None:
        self._link = link
        self._lock = lock
        self._entry = entry
        self._motions: list[Motion[Any]] = []
        self._current: Motion[Any] | None = None
        self._stepper = 0

    @property
    def stepping(self) -> bool:
        """Whether the calling thread runs a step; steps never wait for a lost link, as they would hold up others."""
        return self._stepper == threading.get_ident()

    def start(self, ports: Iterable[OutputPort], steps: Steps[R]) -> Motion[R]:
        """Cancel other motions of these motors and begin a new one; its first step runs at once.

        Raises:
            NXTError: The error that ended it in its first step. If that was the loss of the link, this waits first
                until the link is open again, as a request does.
        """
        motion = Motion(self, self._link, frozenset(ports), steps)
        with self._ahead(), self._lock:
            self.claim(motion.ports)
            self._motions.append(motion)
            self._advance(motion)
        self._link.wake()
        if motion.done:
            try:
                motion.join()
            except LinkLost as lost:
                self._link.after_motion(lost)
        return motion

    def claim(self, ports: Iterable[OutputPort]) -> None:
        """Cancel the motions of these motors, which are about to get other commands."""
        if not self._motions:
            return
        wanted = set(ports)
        with self._ahead(), self._lock:
            for motion in [motion for motion in self._motions if wanted & motion.ports]:
                self.end(motion, Cancelled(replaced=True))

    def run_due(self) -> None:
        """Run one step of each motion that is due, the most overdue first."""
        if not self._motions or self.stepping:  # called by a request of a step: other steps run after it
            return
        now = self._link.now() + RESOLUTION_S
        motions = tuple(self._motions)  # commands of other threads change the list meanwhile
        for motion in sorted((each for each in motions if each.due <= now), key=lambda each: each.due):
            with self._entry:
                pass
            with self._lock:
                if motion.due <= now:  # unless it was ended meanwhile, or another thread ran the step
                    alive = motion.transport is self._link.transport and not self._link.lost
                    self._advance(motion, None if alive else _lost())

    def end(self, motion: Motion[Any], reason: Cancelled) -> None:
        """Cancel a motion.

        Raises:
            LocalProtocolError: Called by a step of this motion.
        """
        with self._ahead(), self._lock:
            if motion.done:
                return
            if motion is self._current:
                raise LocalProtocolError("a motion cannot be cancelled by a guard of its own.")
            self._advance(motion, reason)

    def end_all(self) -> None:
        """Cancel every motion."""
        with self._ahead(), self._lock:
            for motion in [motion for motion in self._motions if motion is not self._current]:
                self.end(motion, Cancelled())

    def _ahead(self) -> AbstractContextManager[object]:
        """Go before the next step; a command of a step itself already holds the lock."""
        return nullcontext() if self.stepping else self._entry

    def _advance(self, motion: Motion[Any], reason: BaseException | None = None) -> None:
        outer = self._current, self._stepper
        self._current, self._stepper = motion, threading.get_ident()
        try:
            motion.advance(reason)
        finally:
            self._current, self._stepper = outer
            if motion.done:
                self._motions.remove(motion)
            self._link.schedule(min((motion.due for motion in self._motions), default=math.inf))


def _lost() -> LinkLost:
    return LinkLost("the link was lost during the motion.", remedy="The motors have stopped; start them again.")
