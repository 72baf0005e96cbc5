"""What must be said at its time while the program lives: "stay awake", each running motor's lease, a brake."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class _Job:
    telegram: bytes
    due: float
    interval_s: float
    until: float


class Heartbeat:
    """Telegrams with times; the one who owns the link asks what is due and sends it.

    Attributes:
        due: Earliest time at which something is due, on the link's clock; infinity if nothing ever is.
        punctual: Whether something is due once, and then even amid a request.
    """

    def __init__(self) -> None:
        self.due = math.inf
        self.punctual = False
        self._jobs: dict[str, _Job] = {}
        self._lock = threading.Lock()

    def repeat(self, name: str, telegram: bytes, interval_s: float, now: float, until: float = math.inf) -> None:
        """Let `telegram` be due every `interval_s`, first one interval from now; replaces the job of that name.

        After `until` it is not due any more, even if nobody has asked since it was.
        """
        with self._lock:
            self._jobs[name] = _Job(telegram, now + interval_s, interval_s, until)
            self._reckon()

    def once(self, name: str, telegram: bytes, due: float) -> None:
        """Let `telegram` be due at `due`, and never again; replaces the job of that name."""
        with self._lock:
            self._jobs[name] = _Job(telegram, due, math.inf, math.inf)
            self._reckon()

    def forget(self, name: str) -> None:
        """Let nothing of that name be due any more."""
        with self._lock:
            if self._jobs.pop(name, None):
                self._reckon()

    def clear(self) -> None:
        """Let nothing be due any more."""
        with self._lock:
            self._jobs.clear()
            self._reckon()

    def take(self, now: float) -> list[bytes]:
        """The telegrams due at `now`; they are next due one interval later."""
        taken = []
        with self._lock:
            for name, job in list(self._jobs.items()):
                if job.due > now:
                    continue
                if now <= job.until:
                    taken.append(job.telegram)
                self._jobs[name] = again = replace(job, due=now + job.interval_s)
                if again.due >= job.until:
                    del self._jobs[name]
            self._reckon()
        return taken

    def _reckon(self) -> None:
        self.due = min((job.due for job in self._jobs.values()), default=math.inf)
        self.punctual = any(math.isinf(job.interval_s) for job in self._jobs.values())
