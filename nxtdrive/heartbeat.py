"""What must be said at its time while the program lives: "stay awake", each running motor's lease, a brake."""

from __future__ import annotations

import math
import threading


class Heartbeat:
    """Telegrams with times; the one who owns the link asks what is due and sends it.

    Attributes:
        due: Earliest time at which something is due, on the link's clock; infinity if nothing ever is.
        punctual: Whether something is due once, and then even amid a request.
    """

    def __init__(self) -> None:
        self.due = math.inf
        self.punctual = False
        self._jobs: dict[str, tuple[float, float, bytes]] = {}
        self._lock = threading.Lock()

    def repeat(self, name: str, telegram: bytes, interval_s: float, now: float) -> None:
        """Let `telegram` be due every `interval_s`, first one interval from now; replaces the job of that name."""
        with self._lock:
            self._jobs[name] = (now + interval_s, interval_s, telegram)
            self._reckon()

    def once(self, name: str, telegram: bytes, due: float) -> None:
        """Let `telegram` be due at `due`, and never again; replaces the job of that name."""
        with self._lock:
            self._jobs[name] = (due, math.inf, telegram)
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
            for name, (due, interval_s, telegram) in list(self._jobs.items()):
                if due <= now:
                    taken.append(telegram)
                    self._jobs[name] = (now + interval_s, interval_s, telegram)
                    if math.isinf(interval_s):
                        del self._jobs[name]
            self._reckon()
        return taken

    def _reckon(self) -> None:
        self.due = min((due for due, _, _ in self._jobs.values()), default=math.inf)
        self.punctual = any(math.isinf(interval_s) for _, interval_s, _ in self._jobs.values())
