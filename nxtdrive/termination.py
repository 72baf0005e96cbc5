"""Signals that would end the process at once, turned into an exception, so that `with` blocks end in good order."""

from __future__ import annotations

import signal
import threading
from types import FrameType

_NAMES = ("SIGTERM", "SIGHUP")
"""The system's request to end, and a terminal that was closed; not every system has both."""


class TerminationAsExit:
    """While it is in force, SIGTERM and SIGHUP raise `SystemExit` in the main thread.

    A program that handles or ignores one of them itself goes on to do so.
    """

    def __init__(self) -> None:
        self._replaced: list[signal.Signals] = []

    def begin(self) -> None:
        """Put it in force; does nothing outside the main thread, where Python allows no handlers."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number in (signal.Signals[name] for name in _NAMES if name in signal.Signals.__members__):
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _leave)
                self._replaced.append(number)

    def end(self) -> None:
        """Let the system do again what it does without us."""
        replaced, self._replaced = self._replaced, []
        for number in replaced:
            if signal.getsignal(number) is _leave:
                signal.signal(number, signal.SIG_DFL)


def _leave(number: int, _frame: FrameType | None) -> None:
    """End as a shell reports a process that the signal ended."""
    raise SystemExit(128 + number)
