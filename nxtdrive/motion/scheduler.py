"""Motions under way: several at once, waited for or not, each advanced a step at a time.

A motion is a generator. It asks and tells the brick what it must, and yields when, on the link's clock, it wants to go
on. In the simulator, where time passes only while somebody waits, whoever lets time pass advances all motions; on real
links a background thread does.
"""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Generator, Iterable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkLost, LocalProtocolError

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.transports.base import Transport

R = TypeVar("R")
Steps = Generator[float, None, R]
"""A motion: yields times on the link's clock at which to go on, and returns its outcome."""

RESOLUTION_S = 0.0005
"""What is due so soon is due now: the simulator's clock has steps of a millisecond."""

log = logging.getLogger(__name__)


class Cancelled(Exception):
    """Thrown into a motion that shall end now; the motion brakes its motors and returns its outcome.

    Attributes:
        replaced: Whether somebody else is about to command a motor of it.
    """

    def __init__(self, *, replaced: bool = False) -> None:
        super().__init__()
        self.replaced = replaced


class Motion(Generic[R]):
    """A motion under way, or what has become of it.

    Attributes:
        ports: Motors that take part.
        transport: The link it began on.
        due: When it goes on, on the link's clock; infinity when it is over.
    """

    def __init__(
        self, board: MotionScheduler, ports: frozenset[OutputPort], steps: Steps[R], transport: Transport
    ) -> None:
        self.ports = ports
        self.transport = transport
        self.due = math.inf
        self._board = board
        self._steps = steps
        self._ended = threading.Event()
        self._outcome: R | None = None
        self._error: BaseException | None = None

    @property
    def done(self) -> bool:
        """Whether it is over, in whatever way."""
        return self._ended.is_set()

    def join(self) -> R:
        """Wait until it is over; an exception while waiting, such as Ctrl-C, cancels it.

        Returns:
            Its outcome.

        Raises:
            NXTError: What ended it, if that was an error; the motors were told to brake if they could be reached.
        """
        try:
            while not self.done:
                self._board.wait(self._ended, self.due)
        except BaseException:
            self.cancel()
            raise
        if self._error is not None:
            if isinstance(self._error, LinkLost):
                self._board.told()
            raise self._error
        return self._outcome  # type: ignore[return-value]  # without an error there is an outcome

    def cancel(self) -> None:
        """End it now, motors braked; nothing happens if it is over already."""
        self._board.end(self, Cancelled())

    def advance(self, reason: BaseException | None = None) -> None:
        """Run the next step, or end the motion for `reason`; the board does this.

        Raises:
            BaseException: An interrupt from outside met the step; the motion is over.
        """
        try:
            self.due = next(self._steps) if reason is None else self._steps.throw(reason)
        except StopIteration as end:
            self._end(end.value, None)
        except Exception as error:  # noqa: BLE001 - whatever it is, it belongs to him who joins
            self._end(None, error)
        except BaseException as error:
            self._end(None, error)
            raise

    def _end(self, outcome: R | None, error: BaseException | None) -> None:
        if error is not None:
            log.info("a motion of %s ended: %s", ", ".join(port.name for port in self.ports), error)
        self._outcome, self._error, self.due = outcome, error, math.inf
        self._ended.set()


class MotionScheduler:
    """The motions of a brick; no motor takes part in two.

    Args:
        brick: Its clock counts, and with its link a motion ends.

    Attributes:
        due: When the next motion goes on; infinity when none is under way.
    """

    def __init__(self, brick: Brick) -> None:
        self.due = math.inf
        self._brick = brick
        self._inline = brick.transport.simulated
        self._lock = threading.RLock()
        self._moves: list[Motion[Any]] = []
        self._current: Motion[Any] | None = None
        self._stepper = 0
        self._thread: threading.Thread | None = None
        self._nudged = threading.Event()

    def start(self, ports: Iterable[OutputPort], steps: Steps[R]) -> Motion[R]:
        """Begin a motion: run its first step now, and the others when they are due. Others of its motors are cancelled.

        Raises:
            NXTError: What ended it in its first step.
        """
        move = Motion(self, frozenset(ports), steps, self._brick.transport)
        with self._lock:
            self.claim(move.ports)
            self._moves.append(move)
            self._advance(move)
            self._live()
        if move.done:
            move.join()
        return move

    def claim(self, ports: Iterable[OutputPort]) -> None:
        """Cancel the motions these motors take part in: somebody else commands them from now on."""
        if not self._moves:
            return
        wanted = set(ports)
        with self._lock:
            for move in [move for move in self._moves if wanted & move.ports]:
                self.end(move, Cancelled(replaced=True))

    @property
    def stepping(self) -> bool:
        """Whether the calling thread is running steps that are due, for which the program does not wait."""
        return self._stepper == threading.get_ident()

    def told(self) -> None:
        """The program has heard that a motion ended with its link."""
        self._brick.acknowledge()

    def run_due(self) -> None:
        """Run one step of each motion that is due, the longest due first."""
        with self._lock:
            if self._current is not None:
                return  # a step asks the brick something, and time passes meanwhile; the others are run afterwards
            self._stepper = threading.get_ident()
            try:
                self._run_until(self._brick.now() + RESOLUTION_S)
            finally:
                self._stepper = 0

    def end(self, move: Motion[Any], reason: Cancelled) -> None:
        """Cancel a motion.

        Raises:
            LocalProtocolError: It is a step of its own that asks for this.
        """
        with self._lock:
            if move.done:
                return
            if move is self._current:
                raise LocalProtocolError("a motion cannot be cancelled by the guard it asks.")
            self._advance(move, reason)

    def end_all(self) -> None:
        """Cancel every motion, and wait for the thread that drove them."""
        with self._lock:
            for move in [move for move in self._moves if move is not self._current]:
                self.end(move, Cancelled())
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            self._nudged.set()
            thread.join()

    def wait(self, ended: threading.Event, due: float) -> None:
        """Let time pass until a motion that is due at `due` may have gone on."""
        if not self._inline:
            ended.wait()
        elif (left_s := due - self._brick.now()) > RESOLUTION_S:
            self._brick.sleep(left_s)
        else:
            self.run_due()

    def _run_until(self, now: float) -> None:
        for move in sorted((move for move in self._moves if move.due <= now), key=lambda move: move.due):
            if not move.done:
                alive = move.transport is self._brick.transport and not self._brick.lost
                self._advance(move, None if alive else _lost())

    def _advance(self, move: Motion[Any], reason: BaseException | None = None) -> None:
        outer, self._current = self._current, move
        try:
            move.advance(reason)
        finally:
            self._current = outer
            if move.done:
                self._moves.remove(move)
            self.due = min((move.due for move in self._moves), default=math.inf)
            self._brick.attend_by(self.due)

    def _live(self) -> None:
        """See to the thread, where time passes by itself; the caller holds the lock."""
        self._nudged.set()
        if self._moves and not self._inline and self._thread is None:
            self._thread = threading.Thread(target=self._drive, name="nxtdrive motions", daemon=True)
            self._thread.start()

    def _drive(self) -> None:
        """What the thread does while there are motions."""
        while True:
            with self._lock:
                if not self._moves:
                    self._thread = None
                    return
                self.run_due()
                pause_s = self.due - self._brick.now()
            if pause_s > 0:
                self._nudged.wait(None if math.isinf(pause_s) else pause_s)
            self._nudged.clear()


def _lost() -> LinkLost:
    return LinkLost("the link was lost during the motion.", remedy="The motors have stopped; start them again.")
