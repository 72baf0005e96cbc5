"""The owner of the wire: requests over a transport, from any thread, and the work that is due beside them.

One request is on the wire at a time; commands that drive motors overtake requests that wait. `LinkCore` says what else
is due: telegrams at their time, steps of motions, attempts to reopen a lost link. Two ways lead to that work. With real
hardware a thread waits for it. In the simulator, where time passes only while the program waits, the program does it
before each request and while it sleeps. Both call `Link.work`.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from typing import Any, TypeVar

from firmware_protocol.direct import KeepAlive, SetInputMode
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError, LinkLost, NXTError
from firmware_protocol.telegram import Command, Reply
from nxtdrive.link.core import LinkCore, LinkState
from nxtdrive.link.latency import LATENCIES, LATENCY_EVERY_S, answer_s
from nxtdrive.link.priority_lock import PREEMPTING, PriorityLock
from nxtdrive.link.reconnect import Reconnector, interrupted
from nxtdrive.link.scheduler import RESOLUTION_S, Motion, MotionScheduler
from nxtdrive.link.threads import THREADS, Lock, Threads
from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)

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
        motions: Motions under way.
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
        self.use(transport)
        self._stepped = transport.simulated
        self._threads = threads
        self._lock = PriorityLock(threads)
        self._queue, self._free = self._lock.queue, self._lock.free
        self.motions = MotionScheduler(self, threads.lock(reentrant=True))
        self._attention = -math.inf
        self._measuring = False
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self._thread: threading.Thread | None = None
        self._news = threading.Event()
        self._reconnector = Reconnector(self, self._core)
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
            if self._queue or not self._free.acquire(False):
                self._lock.acquire(isinstance(command, PREEMPTING), timeout_s)
                now = self.now()
            try:
                dialogue = self._dialogue
                self._send(dialogue.open(command, now, timeout_s))
                telegram = self._receive(timeout_s) if now < self._attention else None
                reply = None if telegram is None else dialogue.feed(telegram)
                if reply is None:
                    reply = self._await()
                if self._measuring:
                    self._latencies.append(self.now() - now)
                    self._measuring = False
                return reply  # type: ignore[return-value]
            finally:
                self._free.release()
                if self._queue:
                    self._lock.call_next()
        except LinkLost as error:
            lost = error
        self._reconnector.outlast(lost, self.reconnect_timeout_s, command)
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
            self._reconnector.check()
            with self._lock.exclusive():
                self._send(telegram)
                self._send_due(self.now())
            return
        except LinkLost as error:
            lost = error
        self._reconnector.outlast(lost, 0.0 if known else self.reconnect_timeout_s, command)
        raise interrupted(command) from lost

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
            self.motions.run_due()
        while (left := end - self.now()) > RESOLUTION_S:
            if self._stepped:
                self.transport.sleep(min(left, max(STEP_S, self._core.due - self.now())))
                self.work(step=end - self.now() > RESOLUTION_S)
            else:
                self.transport.sleep(min(left, SLICE_S))
            self._reconnector.check()

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
        return sorted(self._latencies)[len(self._latencies) // 2]  # `statistics` takes longer to load than all of this

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
            self.motions.run_due()

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
        return self._reconnector.wished

    @reconnecting.setter
    def reconnecting(self, wished: bool) -> None:
        self._reconnector.wished = wished
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
        """Open the link again after it was lost; input ports get their modes again, motors are not started again.

        Raises:
            BrickNotFound: It is not back yet.
            LinkError: It is back, but cannot be opened.
        """
        if self._core.begin_attempt():
            self._core.acknowledge()
            self._reconnector.reopen()

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

    # --- for the link's own parts ---

    @property
    def acts_for_program(self) -> bool:
        """Whether the calling thread acts for the program, and not for a motion or the link itself."""
        return not self.motions.stepping and threading.current_thread() is not self._thread

    def exclusive(self) -> AbstractContextManager[None]:
        """Hold the wire for a block, before all ordinary requests."""
        return self._lock.exclusive()

    def pause(self, duration_s: float) -> None:
        """Let some time pass while the link is lost; in the simulator the work is done meanwhile."""
        self.transport.sleep(min(SLICE_S, duration_s))
        if self._stepped:
            self.work()

    def use(self, transport: Transport) -> None:
        """Go on over another transport to the same brick."""
        self.transport = transport
        self.max_telegram = transport.max_telegram
        # Looked up once: `request` is called hundreds of times a second.
        self.now, self._receive, self._send = transport.now, transport.receive, transport.send

    def _attend(self, now: float) -> float:
        """See to what is due before a request; returns the time afterwards."""
        core = self._core
        if self.before_request:
            self.before_request()
        self._reconnector.check()
        if self._stepped:
            self.motions.run_due()
        if core.timers.due <= self.now():
            with self._lock.exclusive():
                self._send_due(self.now())
        steps_due = core.steps_due if self._stepped else math.inf
        always = self.before_request or core.timers.punctual
        self._attention = -math.inf if always else min(core.timers.due, steps_due, now + LATENCY_EVERY_S)
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
                self.work()

    def work(self, *, step: bool = True) -> None:
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
                self._reconnector.lose(error)
        if step:
            self.motions.run_due()
        if core.attempt_due <= self.now() and core.begin_attempt(self.now()):
            with suppress(NXTError):
                self._reconnector.reopen()
