"""Telegrams to send at set times: keep-alive, renewals of leases, brakes."""

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
    """Named timers, each with a telegram. May be used from several threads.

    Attributes:
        due: When the next telegram is due, on the link's clock; infinity if there is none.
        punctual: Whether there is a telegram of `once`, which must not wait until a request is over.
    """

    def __init__(self) -> None:
        self.due = math.inf
        self.punctual = False
        self._timers: dict[str, _Timer] = {}
        self._lock = threading.Lock()

    def repeat(self, name: str, telegram: bytes, interval_s: float, now: float, until: float = math.inf) -> None:
        """Send `telegram` every `interval_s`, first after one interval; replaces the timer of that name.

        It is never due after `until`, even if it was not taken in time.
        """
        with self._lock:
            self._timers[name] = _Timer(telegram, now + interval_s, interval_s, until)
            self._update_due()

    def once(self, name: str, telegram: bytes, due: float) -> None:
        """Send `telegram` once at `due`; replaces the timer of that name."""
        with self._lock:
            self._timers[name] = _Timer(telegram, due, math.inf, math.inf)
            self._update_due()

    def cancel(self, name: str) -> None:
        """Cancel the timer of that name, if there is one."""
        with self._lock:
            if self._timers.pop(name, None):
                self._update_due()

    def clear(self) -> None:
        """Cancel all timers."""
        with self._lock:
            self._timers.clear()
            self._update_due()

    def take(self, now: float) -> list[bytes]:
        """Take the telegrams that are due at `now`; they are due again one interval later."""
        if now < self.due:
            return []
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
        self.punctual = any(math.isinf(timer.interval_s) for timer in timers)
