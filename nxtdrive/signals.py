"""Handle the signals that end programs, so that programs end in good order."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import NoReturn

TERMINATION = ("SIGTERM", "SIGHUP")
"""The system's request to end, and a closed terminal; not every system has both."""


@contextmanager
def handling(
    handler: Callable[[int, FrameType | None], object],
    names: tuple[str, ...] = ("SIGINT", *TERMINATION),
    *,
    only_unhandled: bool = False,
) -> Iterator[None]:
    """Have signals call `handler`; does nothing outside the main thread, where Python allows no handlers.

    Args:
        handler: Called in the main thread with the signal's number and the current frame.
        names: Of the signals; those that this system lacks are skipped.
        only_unhandled: Skip signals that the program handles or ignores itself.
    """
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.Signals[name] for name in names if name in signal.Signals.__members__):
            if not only_unhandled or signal.getsignal(number) is signal.SIG_DFL:
                before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        for number, previous in before.items():
            if signal.getsignal(number) is handler:  # else the program has replaced it meanwhile
                signal.signal(number, previous)


@contextmanager
def until_signal() -> Iterator[Callable[[], bool]]:
    """Give a function that returns True once SIGINT, SIGTERM or SIGHUP has arrived."""
    arrived = False

    def note(*_: object) -> None:
        nonlocal arrived
        arrived = True  # no threading.Event: a second signal during its set() would wait for ever

    with handling(note):
        yield lambda: arrived


def termination_as_interrupt() -> AbstractContextManager[None]:
    """Have SIGTERM end the program as Ctrl-C does."""
    return handling(signal.default_int_handler, ("SIGTERM",))


def termination_as_exit() -> AbstractContextManager[None]:
    """Have SIGTERM and SIGHUP raise `SystemExit`, which leaves `with` blocks.

    A signal that the program handles or ignores itself is left alone.
    """
    return handling(_exit, TERMINATION, only_unhandled=True)


def _exit(number: int, _frame: FrameType | None) -> NoReturn:
    """Exit with the code by which a shell reports a process that the signal ended."""
    raise SystemExit(128 + number)
