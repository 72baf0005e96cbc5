"""Requests over a transport, from any thread, and the background work of a link.

One request is on the wire at a time; commands that drive motors go before other waiting requests. `LinkCore` schedules
background work: timed telegrams, steps of motions, attempts to reopen a lost link. On real hardware a thread
does it. In the simulator, where time passes only while the program waits, the program does it before each request and
while it sleeps. Both call `Link.work`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from firmware_protocol.direct import KeepAlive
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkLost, LinkTimeout, NXTError
from firmware_protocol.telegram import Command, Reply
from nxtdrive.link.core import LinkCore, LinkState
from nxtdrive.link.link_thread import LinkThread
from nxtdrive.link.priority_lock import PREEMPTING, PriorityLock
from nxtdrive.link.reconnect import PROBE_S, RECONNECT_TIMEOUT_S, Reconnector, interrupted
from nxtdrive.link.scheduler import RESOLUTION_S, STEP_S, Motion, MotionScheduler
from nxtdrive.link.threads import CLOSING_S, THREADS, Lock, Threads
from nxtdrive.link.timeouts import TIMEOUT_RANGE_S, default_timeout_s
from nxtdrive.ports import in_range
from nxtdrive.transports.base import Transport, drain

R = TypeVar("R", bound=Reply)

AWAKE, PROBE = "awake", "probe"
SHORTEST_SILENCE_S, LONGEST_SILENCE_S = 1.0, 60.0
"""Shortest and longest interval of keep-alive telegrams. The longest one is for a brick that never switches itself off,
or only after minutes. A sleep timer that would need a shorter one is an error of the brick, which counts minutes."""
LATENCY_EVERY_S = 0.05
"""Time between two measured round trips; measuring all of them would slow every request down."""
LATENCIES = 15
"""Number of measurements in the median."""
SLICE_S = 0.1
"""A waiting program checks this often whether another thread has noticed a loss of the link."""


class Link:
    """A connection to a brick. May be used from several threads.

    Args:
        transport: An open transport.
        timeout_s: Default timeout of a reply; None: 1 s over USB, 2 s otherwise.
        reconnecting: Whether a lost link is reopened automatically.
        threads: Starts threads and waits for them; not used if the transport is simulated.

    Attributes:
        transport: The transport in use; replaced on reconnection.
        timeout_s: Default timeout of a reply.
        reconnect_timeout_s: How long a request waits for a lost link to be reopened; with 0 it fails at once.
        max_telegram: Longest telegram on this link, bytes.
        now: The link's clock: seconds since an arbitrary start.
        motions: Runs the motions.
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
        self.timeout_s = default_timeout_s(transport) if timeout_s is None else timeout_s
        self.reconnect_timeout_s = RECONNECT_TIMEOUT_S
        self.driven_ports: set[OutputPort] = set()
        self.before_request: Callable[[], None] | None = None
        self._core = LinkCore()
        self._check_due = -math.inf
        self._dialogue = self._core.dialogue
        self.use(transport)
        self._stepped = transport.simulated
        self._threads = threads
        self._lock = PriorityLock(threads)
        self._queue, self._rlock = self._lock.queue, self._lock.rlock
        self.motions = MotionScheduler(self, threads.new_lock(reentrant=True), threads.new_lock(reentrant=True))
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self._measuring = False
        self._thread = None
        if not self._stepped:
            core = self._core
            self._thread = LinkThread(transport.address, self.work, lambda: core.due - self.now(), core, threads)
        self._reconnector = Reconnector(self, self._core, self._lock)
        self.reconnecting = reconnecting

    # --- requests ---

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Send a command and return its reply.

        Waits at most `timeout_s` for the reply, or twice that if an earlier one is missing, and up to the same time for
        other threads first. If the link is lost while `reconnecting`, waits at most `reconnect_timeout_s` for it, also
        if it is lost several times. Then a command that changes nothing is sent again, unless motors were driven: they
        have stopped; the caller decides.

        Raises:
            LocalProtocolError: A value does not fit its field, or `timeout_s` is not 0.001..3600; nothing was sent.
            LinkError: The link is lost or closed, or (LinkTimeout) there was no reply in time.
            RemoteProtocolError: The reply does not match the command.
            BrickError: The brick refused; see its `status`.
        """
        if timeout_s is None:
            timeout_s = self.timeout_s
        else:
            in_range("timeout_s", timeout_s, *TIMEOUT_RANGE_S)
        lost_s = math.inf
        while True:
            try:
                now = self.now()
                if now >= self._check_due:
                    now = self._check_before_request(now)
                try:  # as in `PriorityLock.exclusive`; a call of it would cost time
                    if self._queue or not self._rlock.acquire(False):
                        self._lock.wait(preempting=isinstance(command, PREEMPTING), timeout_s=timeout_s)
                        now = self.now()
                    dialogue = self._dialogue
                    if self._waiting():
                        dialogue.discard(drain(self.transport))
                    self._send(dialogue.open(command, now, timeout_s))
                    telegram = self._receive(timeout_s) if now < self._check_due else None
                    reply = None if telegram is None else dialogue.feed(telegram)
                    if reply is None:
                        reply = self._await()
                    if self._measuring:
                        self._latencies.append(self.now() - now)
                        self._measuring = False
                    return reply  # type: ignore[return-value]
                finally:
                    try:  # noqa: SIM105
                        self._rlock.release()
                    except RuntimeError:
                        pass
                    if self._queue:
                        self._lock.wake_next()
            except LinkLost as lost:
                lost_s = min(lost_s, self.now())
                self._reconnector.recover(lost, self.reconnect_timeout_s, command, lost_s)

    def send(self, command: Command[Any]) -> None:
        """Send a command without requesting a reply, and so without knowing whether the brick executes it.

        If this finds the link lost, it waits as `request` does; if the loss is known already, it fails at once.

        Raises:
            LocalProtocolError: A value does not fit its field; nothing was sent.
            LinkError: The link is lost or closed.
        """
        telegram, known = command.encode(want_reply=False), self.lost
        try:
            self._reconnector.check()
            self._lock.exclusive(self._send_due, telegram)
        except LinkLost as lost:
            self._reconnector.recover(lost, 0.0 if known else self.reconnect_timeout_s, command)
            raise interrupted(command) from lost

    def sleep(self, duration_s: float) -> None:
        """Sleep on the link's clock, for the full time even if the link is lost; background work continues.

        Raises:
            LinkLost: The link was lost and does not reconnect, or is open again, but motors had been driven.
        """
        if self.before_request:
            self.before_request()
        end = self.now() + (max(duration_s, STEP_S) if duration_s > 0 else duration_s)
        if self._stepped:
            self.motions.run_due()
        while (left := end - self.now()) > RESOLUTION_S:
            if self._stepped:
                self.transport.sleep(min(left, max(STEP_S, self._core.due - self.now())))
                self.work(step=end - self.now() > RESOLUTION_S)
            else:
                self.transport.sleep(min(left, SLICE_S))
            self._reconnector.report()

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off while the link is open."""
        sleep_ms = self.request(KeepAlive()).sleep_ms
        interval_s = max(SHORTEST_SILENCE_S, min(LONGEST_SILENCE_S, sleep_ms / 3000)) if sleep_ms else LONGEST_SILENCE_S
        self.repeat(AWAKE, KeepAlive(), interval_s)

    @property
    def surplus_telegrams(self) -> int:
        """Number of telegrams that arrived without belonging to a request."""
        return self._dialogue.surplus_telegrams

    @property
    def latency_s(self) -> float:
        """Round-trip time of a request: the median of the last measurements."""
        if not self._latencies:
            self.request(KeepAlive())
        return sorted(self._latencies)[len(self._latencies) // 2]  # `statistics` takes longer to load than all of this

    # --- work at its time ---

    def repeat(self, name: str, command: Command[Any], interval_s: float, until_s: float = math.inf) -> None:
        """Send `command` without asking for a reply every `interval_s` until `until_s`; see `cancel_timer`."""
        self._core.timers.repeat(name, command.encode(want_reply=False), interval_s, self.now(), until_s)
        self.wake()

    def send_at(self, name: str, command: Command[Any], time_s: float) -> None:
        """Send `command` once at `time_s`, even while a request waits for its reply; see `cancel_timer`."""
        self._core.timers.once(name, command.encode(want_reply=False), time_s)
        self.wake()

    def cancel_timer(self, name: str) -> None:
        """Cancel the timer that `repeat` or `send_at` started under `name`."""
        self._core.timers.cancel(name)

    def mark_driven(self, port: OutputPort) -> None:
        """Record that a motor is under power: a loss is then reported, and the motor is stopped in the end."""
        self.driven_ports.add(port)
        self._core.motors_driven = True

    def schedule(self, due: float) -> None:
        """Run the next step of a motion at `due`."""
        self._core.steps_due = due
        if self._stepped:
            self._check_due = min(self._check_due, due)

    def wake(self) -> None:
        """Make the next request and the link's thread check the schedule."""
        self._check_due = -math.inf
        if self._thread:
            self._thread.wake()

    def wait_for(self, motion: Motion[Any]) -> None:
        """Wait until a motion may have advanced; the caller repeats this."""
        if not self._stepped:
            if self.before_request:
                self.before_request()
            self._threads.wait(motion.ended, SLICE_S)  # an unlimited wait ignores Ctrl-C on Windows
            self._reconnector.report()
        elif (left := motion.due - self.now()) > RESOLUTION_S:
            self.sleep(left)
        else:
            self.motions.run_due()

    def new_lock(self) -> Lock:
        """Make a lock that may be held during a request; not reentrant."""
        return self._threads.new_lock()

    # --- losses ---

    @property
    def state(self) -> LinkState:
        """Whether the link is open, lost, being reopened, or closed."""
        return self._core.state

    @property
    def lost(self) -> bool:
        """Whether the link is known to be lost and will be reopened."""
        return math.isfinite(self._core.attempt_due)

    @property
    def reconnecting(self) -> bool:
        """Whether a lost link is reopened automatically, even while the program makes no requests; may be set.

        A loss is noticed within about 2 s, by a probe. In the simulator this needs a program that sleeps on the link's
        clock.
        """
        return self._core.reconnecting

    @reconnecting.setter
    def reconnecting(self, enabled: bool) -> None:
        self._core.set_reconnecting(enabled, self.now())
        if enabled:
            self.repeat(PROBE, KeepAlive(), PROBE_S)
        else:
            self.cancel_timer(PROBE)

    def acknowledge(self) -> None:
        """Record that a loss was reported to the program, so that it is not reported again."""
        if self._core.state is not LinkState.OPEN or self._core.interrupted:
            self._core.acknowledge()

    def after_motion(self, lost: LinkLost) -> None:
        """Wait until a link that was lost in a motion's first step is open again; always raises."""
        self._reconnector.after_motion(lost, self.reconnect_timeout_s)

    def reconnect(self) -> None:
        """Reopen the link; motors are not started again, and sensors set up their ports again when they are read.

        Raises:
            BrickNotFound: The brick is not back yet.
            LinkError: It is back but cannot be opened, or this link was closed.
        """
        self._reconnector.reconnect(self.reconnect_timeout_s)

    def close(self) -> None:
        """End all motions and close the link; may be called again, and does not fail if the link is lost."""
        try:
            self._core.close()
            self.wake()
            if self._thread:
                self._thread.join()
            self.motions.end_all()
            with suppress(LinkTimeout):
                self._lock.exclusive(self.transport.close, timeout_s=CLOSING_S)  # not during a request
        finally:
            self.transport.close()
        self.motions.end_all()  # another thread may have begun a motion since, and wait for its end

    @property
    def acts_for_program(self) -> bool:
        """Whether the calling thread acts for the program, not for a motion or for the link itself."""
        return not self.motions.stepping and not (self._thread and self._thread.current)

    def pause(self, duration_s: float) -> None:
        """Let up to `duration_s` pass while the link is lost, and in the simulator do the work."""
        self.transport.sleep(min(SLICE_S, duration_s))
        if self._stepped:
            self.work()

    def use(self, transport: Transport) -> None:
        """Switch to another transport; its methods are looked up once, as `request` has to be fast."""
        self.transport = transport
        self.max_telegram = transport.max_telegram
        self.now, self._receive, self._send = transport.now, transport.receive, transport.send
        self._waiting = transport.waiting

    def _check_before_request(self, now: float) -> float:
        """Do the work due before a request; return the time afterwards."""
        core = self._core
        if self.before_request and self.acts_for_program:
            self.before_request()
        self._reconnector.check()
        if self._stepped:
            self.motions.run_due()
        if core.timers.due <= self.now():
            self._lock.exclusive(self._send_due)
        steps_due = core.steps_due if self._stepped else math.inf
        always = self.before_request or core.timers.punctual or core.state is not LinkState.OPEN
        self._check_due = -math.inf if always else min(core.timers.due, steps_due, now + LATENCY_EVERY_S)
        self._measuring = True
        return self.now()

    def _await(self) -> Reply:
        """Wait for the reply to the open request; the caller holds the lock."""
        dialogue = self._dialogue
        while True:
            now = self.now()
            self._send_due()
            if held_back := dialogue.follow_up(now):
                self._send(held_back)
            left = dialogue.deadline - now
            if left <= 0:
                raise dialogue.expire()
            telegram = self._receive(min(left, self._core.timers.due - now))
            if telegram is not None and (reply := dialogue.feed(telegram)) is not None:
                return reply

    def _send_due(self, *first: bytes) -> None:
        """Send `first` and the timed telegrams that are due; the caller holds the lock."""
        for telegram in (*first, *self._core.timers.take(self.now())):
            self._send(telegram)

    def work(self, *, step: bool = True) -> None:
        """Do the work due now: timed telegrams, steps of motions, an attempt to reopen the link.

        Raises:
            LinkError: The link is lost and does not reconnect, or does not accept a telegram.
        """
        core = self._core
        if core.state is LinkState.OPEN and core.timers.due <= self.now():
            try:
                self._lock.exclusive(self._send_due)
            except LinkLost as error:
                self._reconnector.lose(error)
        if step:
            self.motions.run_due()
        if core.begin_attempt(self.now()):
            with suppress(NXTError):
                self._reconnector.reopen()
