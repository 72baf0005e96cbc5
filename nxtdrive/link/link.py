"""The owner of the wire: requests over a transport, from any thread, and the work that is due beside them.

One request is on the wire at a time; commands that drive motors overtake requests that wait. `LinkCore` says what else
is due: telegrams at their time, steps of motions, attempts to reopen a lost link. Two ways lead to that work. With real
hardware a thread waits for it. In the simulator, where time passes only while the program waits, the program does it
before each request and while it sleeps. Both call `Link._work`.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from statistics import median
from typing import Any, TypeVar

from firmware_protocol.direct import (
    GetInputValues,
    KeepAlive,
    ResetMotorPosition,
    SetInputMode,
    SetOutputState,
    UpdateResetCount,
)
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError, LinkLost, NXTError
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.system import IOMapWrite
from firmware_protocol.telegram import Command, Reply
from nxtdrive.link.core import IDEMPOTENT, Interrupted, LinkCore, LinkState
from nxtdrive.link.priority_lock import PriorityLock
from nxtdrive.link.scheduler import RESOLUTION_S, Motion, MotionScheduler, Steps
from nxtdrive.link.threads import THREADS, Lock, Threads
from nxtdrive.transports import reopen_transport
from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)
T = TypeVar("T")

PREEMPTING = (SetOutputState, IOMapWrite, ResetMotorPosition, UpdateResetCount)
"""Commands that drive motors; they overtake others that wait for the wire."""

AWAKE, PROBE = "awake", "probe"
LONGEST_SILENCE_S = 60.0
"""A brick that is set never to sleep, or late, is told to stay awake this often."""
PROBE_S = 2.0
"""How often a link that reconnects by itself is tried out while nothing else is sent."""
RECONNECT_TIMEOUT_S = 30.0
"""How long a request waits for a lost link; a brick that was switched off and on answers over USB within 10 s."""
SLICE_S = 0.1
"""How often a program that waits finds out about a loss of the link that another thread has met."""
CLOSING_S = 2.0
"""How long closing waits for the link's thread, which may be at an attempt to reconnect."""
STEP_S = 2 * RESOLUTION_S
"""Shortest wait in the simulator: one step of its clock."""

CABLE_ANSWER_S = 1.0
"""How long a reply may take over USB, where 2 ms are usual."""
RADIO_ANSWER_S = 2.0
"""Over Bluetooth, which loses nothing but falters. Source: the RWTH toolbox (docs/connecting.md)."""

LATENCY_EVERY_S = 0.05
"""How often a round trip is measured; measuring each would cost every request."""
LATENCIES = 15
"""Round trips of which the median is taken."""


class Link:
    """A conversation over a transport. May be used from several threads.

    Args:
        transport: The way to the brick, open.
        timeout_s: How long a reply may take when the request does not say; by default as usual on such a link.
        reconnecting: Whether a lost link is opened again by itself.
        threads: How threads start and wait, where the transport is not simulated.

    Attributes:
        transport: The way to the brick; another one after a reconnection.
        timeout_s: How long a reply may take when the request does not say.
        reconnect_timeout_s: How long a request waits for a lost link that is being opened again; with 0 it fails at
            once, and the program itself finds out when the brick is back.
        max_telegram: Longest telegram of this link, bytes.
        now: The link's clock: seconds since an arbitrary start.
        driven_ports: Output ports that have been driven.
        before_request: Called before each request and each wait of the program; what it raises reaches the program.
    """

    now: Callable[[], float]

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float | None = None,
        reconnecting: bool = False,
        threads: Threads = THREADS,
    ) -> None:
        self.timeout_s = answer_s(transport) if timeout_s is None else timeout_s
        self.reconnect_timeout_s = RECONNECT_TIMEOUT_S
        self.driven_ports: set[OutputPort] = set()
        self.before_request: Callable[[], None] | None = None
        self._core = LinkCore()
        self._dialogue = self._core.dialogue
        self._use(transport)
        self._stepped = transport.simulated
        self._threads = threads
        self._lock = PriorityLock(threads)
        self._motions = MotionScheduler(self, threads.lock(reentrant=True))
        self._attention = -math.inf
        self._measuring = False
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self._thread: threading.Thread | None = None
        self._news = threading.Event()
        self._attempting = 0
        self._reconnecting = False
        self.reconnecting = reconnecting

    # --- requests ---

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Send a command and return its reply.

        Ends within `timeout_s`, or twice that after a request that was not answered. If the link is lost while
        `reconnecting`, this waits until it is open again, `reconnect_timeout_s` at most. Then a command that changes
        nothing is sent again, unless motors were driven since the last loss: those have stopped meanwhile, and only the
        caller can decide whether to go on.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost, closed, or (LinkTimeout) no reply in time.
            RemoteProtocolError: The reply is not the one of this command.
            BrickError: The brick refused; see its `status`.
        """
        if timeout_s is None:
            timeout_s = self.timeout_s
        try:
            now = self.now()
            if now >= self._attention:
                now = self._attend(now)
            lock, dialogue = self._lock, self._dialogue
            if not lock.try_acquire():
                lock.acquire(isinstance(command, PREEMPTING), timeout_s)
                now = self.now()
            try:
                self._send(dialogue.open(command, now, timeout_s))
                wait_s = min(timeout_s, self._attention - now)
                telegram = self._receive(wait_s) if wait_s > 0 else None
                reply = None if telegram is None else dialogue.feed(telegram)
                if reply is None:
                    reply = self._await()
                if self._measuring:
                    self._latencies.append(self.now() - now)
                    self._measuring = False
                return reply  # type: ignore[return-value]
            finally:
                lock.release()
        except LinkLost as error:
            lost = error
        self._outlast(lost, self.reconnect_timeout_s, command)
        return self.request(command, timeout_s)

    def send(self, command: Command[Any]) -> None:
        """Send a command without asking for a reply; whether the brick obeys is not known.

        If the link is lost meanwhile, this waits as `request` does; if that is known already, it fails at once.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost or closed.
        """
        telegram, known = command.encode(want_reply=False), self.lost
        try:
            self._check()
            with self._lock.exclusive():
                self._send(telegram)
                self._send_due(self.now())
            return
        except LinkLost as error:
            lost = error
        self._outlast(lost, 0.0 if known else self.reconnect_timeout_s, command)
        raise _interrupted(command) from lost

    def sleep(self, duration_s: float) -> None:
        """Let time pass on the link's clock; brick, motions and a lost link are looked after meanwhile.

        How long this lasts does not depend on the link being there.

        Raises:
            LinkLost: The link was lost and does not reconnect; or it is back, but motors were driven before.
        """
        if self.before_request:
            self.before_request()
        end = self.now() + (max(duration_s, STEP_S) if self._stepped and duration_s > 0 else duration_s)
        if self._stepped:
            self._motions.run_due()
        while (left := end - self.now()) > RESOLUTION_S:
            if self._stepped:
                self.transport.sleep(min(left, max(STEP_S, self._core.due - self.now())))
                self._work(step=end - self.now() > RESOLUTION_S)
            else:
                self.transport.sleep(min(left, SLICE_S))
            self._check()

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off, now and, while the link is open, from now on."""
        sleep_ms = self.request(KeepAlive()).sleep_ms
        interval_s = min(LONGEST_SILENCE_S, sleep_ms / 3000) if sleep_ms else LONGEST_SILENCE_S
        self.repeat(AWAKE, KeepAlive(), interval_s)

    @property
    def latency_s(self) -> float:
        """How long a reply takes: the median of the last round trips that were measured."""
        if not self._latencies:
            self.request(KeepAlive())
        return median(self._latencies)

    # --- work at its time ---

    def repeat(self, name: str, command: Command[Any], interval_s: float, until_s: float = math.inf) -> None:
        """Send `command`, without asking for a reply, every `interval_s`, not after `until_s`; see `cancel_timer`."""
        self._core.timers.repeat(name, command.encode(want_reply=False), interval_s, self.now(), until_s)
        self.announce()

    def send_at(self, name: str, command: Command[Any], time_s: float) -> None:
        """Send `command` once, at that time on the link's clock, even amid a request; see `cancel_timer`."""
        self._core.timers.once(name, command.encode(want_reply=False), time_s)
        self.announce()

    def cancel_timer(self, name: str) -> None:
        """End what `repeat` or `send_at` began under `name`."""
        self._core.timers.cancel(name)

    def start_motion(self, ports: Iterable[OutputPort], steps: Steps[T]) -> Motion[T]:
        """Begin a motion: run its first step now, the others at their time. Other motions of its motors are cancelled.

        Raises:
            NXTError: What ended it in its first step.
        """
        return self._motions.start(ports, steps)

    def claim(self, ports: Iterable[OutputPort]) -> None:
        """Cancel the motions in which these motors take part: they get other commands from now on."""
        self._motions.claim(ports)

    def mark_driven(self, port: OutputPort) -> None:
        """Remember that a motor is under power, to tell of it after a loss and to stop it in the end."""
        self.driven_ports.add(port)
        self._core.driven = True

    def schedule(self, due: float) -> None:
        """Run the next step of a motion at that time."""
        self._core.steps_due = due
        if self._stepped:
            self._attention = min(self._attention, due)

    def announce(self) -> None:
        """Have a look at what is due: before the next request, and in the link's thread."""
        self._attention = -math.inf
        self._news.set()
        if not self._stepped and self._thread is None and self._core.state is not LinkState.CLOSED:
            self._thread = self._threads.start(self._run, "nxtdrive link")

    def wait_for(self, motion: Motion[Any]) -> None:
        """Let time pass until a motion may have gone on."""
        if not self._stepped:
            self._threads.wait(motion.ended)
        elif (left := motion.due - self.now()) > RESOLUTION_S:
            self.sleep(left)
        else:
            self._motions.run_due()

    def lock(self) -> Lock:
        """A lock that may be held during a request; not reentrant."""
        return self._threads.lock()

    # --- losses ---

    @property
    def state(self) -> LinkState:
        """Whether the link is open, lost, being opened again, or closed."""
        return self._core.state

    @property
    def lost(self) -> bool:
        """Whether the link is known to be lost, and to be opened again when the brick is back."""
        return math.isfinite(self._core.attempt_due)

    @property
    def reconnecting(self) -> bool:
        """Whether a lost link is opened again by itself: by the next request, and also while the program is idle.

        A loss is noticed within some 2 s: that often something is sent. In the simulator, a program is idle while it
        sleeps on the link's clock.
        """
        return self._reconnecting

    @reconnecting.setter
    def reconnecting(self, wished: bool) -> None:
        self._reconnecting = wished
        if wished:
            self.repeat(PROBE, KeepAlive(), PROBE_S)
        else:
            self.cancel_timer(PROBE)

    def restore_mode(self, mode: SetInputMode) -> None:
        """Set an input port to this mode again after a reconnection, should it have lost it."""
        self._core.modes[mode.port] = mode

    def forget_modes(self) -> None:
        """Set no input port again after a reconnection: a program on the brick uses them from now on."""
        self._core.modes.clear()

    def acknowledge(self) -> None:
        """Take in that the program knows of a loss and that its motors have stopped; it is not told again."""
        if self.lost or self._core.interrupted:
            self._core.acknowledge()

    def reconnect(self) -> None:
        """Open the link again after it was lost: same address, same brick, input ports in the same modes.

        Motors that ran have stopped by themselves, and are not started again.

        Raises:
            BrickNotFound: It is not back yet.
            LinkError: It is back, but cannot be opened.
        """
        if self._core.begin_attempt():
            self._core.acknowledge()
            self._reopen()

    def end_motions(self) -> None:
        """Cancel every motion."""
        self._motions.end_all()

    def close(self) -> None:
        """Close the link; may be called again, and does not fail when the link is gone."""
        if self._core.state is LinkState.CLOSED:
            return
        self._core.close()
        self.announce()
        if self._thread is not None:
            self._threads.join(self._thread, CLOSING_S)
        with self._lock.exclusive():
            self.transport.close()

    # --- how ---

    def _use(self, transport: Transport) -> None:
        self.transport = transport
        self.max_telegram = transport.max_telegram
        # Looked up once: `request` is called hundreds of times a second.
        self.now, self._receive, self._send = transport.now, transport.receive, transport.send

    def _attend(self, now: float) -> float:
        """See to what is due before a request; returns the time afterwards."""
        core = self._core
        if self.before_request:
            self.before_request()
        self._check()
        if self._stepped:
            self._motions.run_due()
        if core.timers.due <= self.now():
            with self._lock.exclusive():
                self._send_due(self.now())
        steps_due = core.steps_due if self._stepped else math.inf
        self._attention = -math.inf if self.before_request else min(core.timers.due, steps_due, now + LATENCY_EVERY_S)
        self._measuring = True
        return self.now()

    def _await(self) -> Reply:
        """Wait for the reply to the open request; the caller holds the lock."""
        dialogue = self._dialogue
        while True:
            now = self.now()
            self._send_due(now)
            if held_back := dialogue.follow_up(now):
                self._send(held_back)
            left = dialogue.deadline - now
            if left <= 0:
                raise dialogue.expire()
            telegram = self._receive(min(left, self._core.timers.due - now))
            if telegram is not None and (reply := dialogue.feed(telegram)) is not None:
                return reply

    def _send_due(self, now: float) -> None:
        """Send the telegrams that are due; the caller holds the lock."""
        if now >= self._core.timers.due:
            for telegram in self._core.timers.take(now):
                self._send(telegram)

    def _run(self) -> None:
        """What the link's thread does: a program that waits for its user still owns a living brick."""
        while self._core.state is not LinkState.CLOSED:
            self._news.clear()
            pause_s = self._core.due - self.now()
            if pause_s > 0:
                self._threads.wait(self._news, None if math.isinf(pause_s) else pause_s)
            with suppress(LinkError):  # the program's next request meets the same error, and there it can be handled
                self._work()

    def _work(self, *, step: bool = True) -> None:
        """Do what is due now: telegrams, steps of motions, an attempt to reconnect.

        Raises:
            LinkError: The link is lost and does not reconnect, or it does not take a telegram.
        """
        core = self._core
        if core.state is LinkState.OPEN and core.timers.due <= self.now():
            try:
                with self._lock.exclusive():
                    self._send_due(self.now())
            except LinkLost as error:
                self._lose(error)
        if step:
            self._motions.run_due()
        if core.attempt_due <= self.now() and core.begin_attempt(self.now()):
            with suppress(NXTError):
                self._reopen()

    def _check(self) -> None:
        """Tell the program of a loss that another thread has met, once.

        Raises:
            Interrupted: The link is back, but motors were driven. A step of a motion is told, too, but does not count.
            LinkLost: It is lost and does not reconnect.
        """
        core = self._core
        if core.state is LinkState.OPEN and core.interrupted:
            if not self._motions.stepping:
                core.acknowledge()
            raise _interrupted()
        if core.untold is not None and not self._motions.stepping:
            lost, core.untold = core.untold, None
            raise lost

    def _lose(self, lost: LinkLost) -> None:
        """Take in that the link is lost.

        Raises:
            LinkLost: It does not reconnect.
        """
        attempting = self._attempting == threading.get_ident()
        if not attempting and self._core.state is not LinkState.CLOSED:
            self._core.lose(lost, self.now(), reconnecting=self._reconnecting)
        self._dialogue.reset()
        if attempting or not self._reconnecting:
            if self._is_program:
                self._core.untold = None
            raise lost
        self.announce()

    @property
    def _is_program(self) -> bool:
        """Whether the calling thread acts for the program, and not for a motion or the link itself."""
        return not self._motions.stepping and threading.current_thread() is not self._thread

    def _outlast(self, lost: LinkLost, timeout_s: float, command: Command[Any]) -> None:
        """Wait until the lost link is open again and `command` may be sent again.

        Raises:
            LinkLost: It does not reconnect, or not in time; or it is open again, but the program has to decide itself
                how to go on.
        """
        if isinstance(lost, Interrupted):
            raise lost
        self._lose(lost)
        if self._motions.stepping:
            raise lost
        core, deadline = self._core, self.now() + timeout_s
        while core.state is not LinkState.OPEN:
            left = deadline - self.now()
            if left <= 0 or core.state is LinkState.CLOSED:
                core.acknowledge()
                waited = f"did not come back within {timeout_s:g} s" if timeout_s else "is not back yet"
                raise LinkLost(f"the link is lost, and the brick {waited}.", remedy="Is it on?") from lost
            self.transport.sleep(min(SLICE_S, left))
            if self._stepped:
                self._work()
        interrupted = core.interrupted
        core.acknowledge()
        if interrupted or not isinstance(command, IDEMPOTENT):
            raise _interrupted(command) from lost

    def _reopen(self) -> None:
        """Open the link again; the core has begun the attempt."""
        core = self._core
        self._attempting = threading.get_ident()
        try:
            with self._lock.exclusive():
                self.transport.close()  # not amid a request; opening it takes long, and needs no lock
            transport = reopen_transport(self.transport, timeout_s=self.timeout_s)
            with self._lock.exclusive():
                if core.state is LinkState.CLOSED:
                    transport.close()
                    raise LinkLost(f"{transport.address} is closed.", remedy="Open the brick again.")
                self._use(transport)
                self._dialogue.reset()
                core.timers.clear()
            self.reconnecting = self._reconnecting  # probes again
            self.keep_alive()
            for port, mode in list(core.modes.items()):
                values = self.request(GetInputValues(port))
                if (values.type, values.mode) != (mode.type, mode.mode):
                    self.request(mode)
            core.reopened(transport.address)
        except BaseException as error:
            core.attempt_failed(error, self.now())
            raise
        finally:
            self._attempting = 0
            self.announce()


def answer_s(transport: Transport) -> float:
    """How long a reply may take on such a link by default; Bluetooth is told by its longer telegrams."""
    return CABLE_ANSWER_S if transport.max_telegram <= USB_TELEGRAM_LIMIT else RADIO_ANSWER_S


def _interrupted(command: Command[Any] | None = None) -> Interrupted:
    """The error for a program that must decide itself how to go on: a motion was under way, or `command` was."""
    what = "a motion was under way" if command is None else f"{type(command).__name__} was not repeated"
    return Interrupted(f"the link was lost and is back, but {what}.", remedy="Motors have stopped; start them again.")
