"""Threads in simulated time: one runs at a time, and time passes when all of them wait.

With it a link with its own thread runs over the simulated brick, as deterministic and fast as a stepped one.
"""

import threading
from collections import deque
from dataclasses import dataclass, field

from firmware_protocol.errors import LinkLost
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from nxtdrive.link.threads import Threads
from sim_backend.link import NO_FAULTS, SimLink

WATCHDOG_S = 20


@dataclass(eq=False)
class Waiting:
    """A thread that waits for `ready` or `deadline_ms`."""

    ready: object
    deadline_ms: float
    called: threading.Event = field(default_factory=threading.Event)


class Lockstep(Threads):
    """Threads that take turns; only the one that runs may call this."""

    def __init__(self, simulation):
        self.simulation = simulation
        self.waiting = deque()

    def block(self, ready, timeout_s=None):
        """Let other threads run, then time pass, until `ready()` or for `timeout_s`; returns whether it is ready."""
        now_ms = self.simulation.now_ms
        # whole milliseconds, and at least one: sums of fractions are not exact
        deadline_ms = float("inf") if timeout_s is None else max(now_ms + 1, now_ms + timeout_s * 1000 - 1e-6)
        me = Waiting(ready, deadline_ms)
        self.waiting.append(me)
        self.pass_on()
        assert me.called.wait(WATCHDOG_S), "a thread waits outside of the lockstep"
        return bool(ready())

    def pass_on(self):
        """Wake the thread that can continue first."""
        while True:
            for each in list(self.waiting):
                if each.ready() or self.simulation.now_ms >= each.deadline_ms:
                    self.waiting.remove(each)
                    each.called.set()
                    return
            assert any(each.deadline_ms < float("inf") for each in self.waiting), (
                f"all threads wait for each other: {[(each.ready, each.deadline_ms) for each in self.waiting]}"
            )
            self.simulation.advance(1)

    def start(self, target, name):
        first = Waiting(lambda: True, 0)

        def run():
            first.called.wait()
            try:
                target()
            finally:
                thread.over = True
                if self.waiting:
                    self.pass_on()

        thread = threading.Thread(target=run, name=name, daemon=True)
        thread.over = False
        self.waiting.append(first)
        thread.start()
        return thread

    def join(self, thread, timeout_s):
        self.block(lambda: thread.over, timeout_s)

    def now(self):
        return self.simulation.now_ms / 1000

    def wait(self, event, timeout_s=None):
        return event.is_set() or self.block(event.is_set, timeout_s)

    def new_lock(self, *, reentrant=False):
        return LockstepLock(self, reentrant)


class LockstepLock:
    """A lock for which threads wait in lockstep."""

    def __init__(self, lockstep, reentrant):
        self.lockstep, self.reentrant = lockstep, reentrant
        self.owner, self.depth = None, 0

    def acquire(self, blocking=True):
        me = threading.get_ident()
        while self.owner is not None and not (self.reentrant and self.owner == me):
            if not blocking:
                return False
            self.lockstep.block(lambda: self.owner is None)
        self.owner, self.depth = me, self.depth + 1
        return True

    def release(self):
        if self.owner != threading.get_ident():
            raise RuntimeError
        self.depth -= 1
        if not self.depth:
            self.owner = None

    def __enter__(self):
        self.acquire()

    def __exit__(self, *_):
        self.release()


class LockstepTransport:
    """A transport to the simulated brick that is used like real hardware, with the link's own thread."""

    address = "lockstep://"
    max_telegram = USB_TELEGRAM_LIMIT
    simulated = False

    def __init__(self, lockstep, *, latency_ms=2, faults=None):
        self.lockstep = lockstep
        self.options = {"latency_ms": latency_ms, "faults": faults}
        try:
            self.link = SimLink(lockstep.simulation, latency_ms, faults or NO_FAULTS)
        except ConnectionError as error:
            raise LinkLost(f"{error}.") from error

    def send(self, telegram):
        try:
            self.link.send(telegram)
        except ConnectionError as error:
            raise LinkLost(f"{error}.") from error

    def receive(self, timeout_s):
        found = []

        def ready():
            if not found:
                try:
                    reply = self.link.poll()
                except ConnectionError as error:
                    reply = LinkLost(f"{error}.")
                if reply is not None:
                    found.append(reply)
            return found

        if not ready():
            self.lockstep.block(ready, timeout_s)
        if found and isinstance(found[0], LinkLost):
            raise found[0]
        return found[0] if found else None

    def waiting(self):
        try:
            return self.link.arrived
        except ConnectionError as error:
            raise LinkLost(f"{error}.") from error

    def close(self):
        self.link.close()

    def reopen(self, timeout_s):
        return type(self)(self.lockstep, **self.options)

    def now(self):
        return self.lockstep.simulation.now_ms / 1000

    def sleep(self, duration_s):
        if duration_s > 0:
            self.lockstep.block(lambda: False, duration_s)
