"""Who drives: one client at a time, by consent."""

from __future__ import annotations

import threading
from collections.abc import Callable


class DriverArbiter:
    """The right to drive by hand.

    Args:
        changed: Called when one of them changes, with the names of the driver and of the client that asks for control;
            empty for none.
    """

    def __init__(self, changed: Callable[[str, str], None]) -> None:
        self._lock = threading.Lock()
        self._changed = changed
        self.driver = ""
        self.asking = ""

    def take(self, client: str) -> bool:
        """Make `client` the driver if nobody drives, else note that it asks; returns whether it drives now."""
        with self._lock:
            before = self.driver, self.asking
            if not self.driver:
                self.driver = client
                self.asking = "" if self.asking == client else self.asking
            elif client != self.driver:
                self.asking = client
            drives = self.driver == client
        self._notify(before)
        return drives

    def give(self, client: str) -> None:
        """Hand control from `client` to the one that asks for it; anyone may withdraw its own request."""
        with self._lock:
            before = self.driver, self.asking
            if client == self.driver:
                self.driver, self.asking = self.asking, ""
            elif client == self.asking:
                self.asking = ""
        self._notify(before)

    def _notify(self, before: tuple[str, str]) -> None:
        if before != (self.driver, self.asking):
            self._changed(self.driver, self.asking)
