"""Telegrams that go out at their time while the program lives: "stay awake", each running motor's lease, a brake."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class _Timer:
    telegram: bytes
    due: float
    interval_s: float
    until: float


class Timers:
    """Telegrams with times, by name. May be used from several threads.

    Attributes:
        due: Earliest time at which a telegram is due, on the link's clock; infinity without any.
        punctual: Whether a telegram is due once, and then even amid a request.
    """

    def __init__(self) -> None:
        self.due = math.inf
        self.punctual = False
        self._timers: dict[str, _Timer] = {}
        self._lock = threading.Lock()

    def repeat(self, name: str, telegram: bytes, interval_s: float, now: float, until: float = math.inf) -> None:
        """Let `telegram` be due every `interval_s`, first one interval from now; replaces the timer of that name.

        After `until` it is not due any more, even if nothing has asked since it was.
        """
        with self._lock:
            self._timers[name] = _Timer(telegram, now + interval_s, interval_s, until)
            self._update_due()

    def once(self, name: str, telegram: bytes, due: float) -> None:
        """Let `telegram` be due at `due`, and never again; replaces the timer of that name."""
        with self._lock:
            self._timers[name] = _Timer(telegram, due, math.inf, math.inf)
            self._update_due()

    def cancel(self, name: str) -> None:
        """End the timer of that name, if there is one."""
        with self._lock:
            if self._timers.pop(name, None):
                self._update_due()

    def clear(self) -> None:
        """End all timers."""
        with self._lock:
            self._timers.clear()
            self._update_due()

    def take(self, now: float) -> list[bytes]:
        """The telegrams due at `now`; they are next due one interval later."""
        taken = []
        with self._lock:
            for name, timer in list(self._timers.items()):
                if timer.due > now:
                    continue
                if now <= timer.until:
                    taken.append(timer.telegram)
                self._timers[name] = again = replace(timer, due=now + timer.interval_s)
                if again.due >= timer.until:
                    del self._timers[name]
            self._update_due()
        return taken

    def _update_due(self) -> None:
        timers = self._timers.values()
        self.due = min((timer.due for timer in timers), default=math.inf)
        self.punctual = any(math.isinf(timer.interval_s) and timer.due < math.inf for timer in timers)
