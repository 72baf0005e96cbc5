"""Handle the signals that end programs, so that programs end cleanly."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from types import FrameType
from typing import NoReturn

TERMINATION = ("SIGTERM", "SIGHUP")
"""The system's request to end, and a closed terminal; not every system has both."""
SIGNALLED = 128
"""Shells add this to the number of the signal that ended a program; programs that handle signals follow them."""
REDELIVERY_S = 0.02
"""A signal that could not interrupt the program is delivered again after this time."""
ABORTING_SIGNALS = 3
"""After this many signals, the program's clean-up, which may hang, is interrupted too."""


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
            # else the program has replaced it in the meantime; or Python reclaims a dropped generator in another thread
            if signal.getsignal(number) is handler and threading.current_thread() is threading.main_thread():
                signal.signal(number, previous)


@contextmanager
def until_signal() -> Iterator[Callable[[], bool]]:
    """Give a function that returns True once SIGINT, SIGTERM or SIGHUP has arrived."""
    arrived = False

    def note(*_: object) -> None:
        nonlocal arrived
        arrived = True  # no threading.Event: a second signal during its set() would wait forever

    with handling(note):
        yield lambda: arrived


@contextmanager
def held() -> Iterator[Callable[[], None]]:
    """Hold back SIGINT, SIGTERM and SIGHUP within the block, which must not be interrupted.

    The first one is delivered at the end of the block, or when the function that the block gets is called.
    """
    arrived: list[int] = []

    def deliver() -> None:
        if arrived:
            signal.raise_signal(arrived[0])

    with ExitStack() as stack:
        stack.callback(deliver)
        stack.enter_context(handling(lambda number, _frame: arrived.append(number)))
        yield stack.close


class SignalInterrupt(KeyboardInterrupt):
    """The interrupt of a command by a signal.

    Attributes:
        number: The signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextmanager
def signals_as_interrupt() -> Iterator[Callable[[], int]]:
    """Have SIGINT, SIGTERM and SIGHUP raise `SignalInterrupt` once, after the end of an import in progress.

    A second one is ignored while the program ends, as a closed terminal sends two; from the third on they interrupt
    that too. An interrupt that Python must drop, as in a finaliser or a callback from C, is raised again.

    Yields:
        A function that returns the number of the first one, or SIGINT's. A mission ends cleanly on it, and
        what ran the mission may then raise a plain KeyboardInterrupt.
    """
    arrived: list[int] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _importing(frame):
            # an extension module whose initialisation is cut short may crash later
            _send_again(number)
            return
        arrived.append(number)
        if len(arrived) == 1 or len(arrived) >= ABORTING_SIGNALS:
            raise SignalInterrupt(number)

    def dropped(number: int) -> None:
        arrived.clear()
        _send_again(number)

    with handling(interrupt), _dropped_interrupts(dropped):
        yield lambda: arrived[0] if arrived else signal.SIGINT


@contextmanager
def _dropped_interrupts(again: Callable[[int], None]) -> Iterator[None]:
    """Call `again` with the signal's number for each `SignalInterrupt` that is raised where no exception can pass."""
    before = sys.unraisablehook

    def hook(unraisable: sys.UnraisableHookArgs) -> None:
        if isinstance(unraisable.exc_value, SignalInterrupt):
            again(unraisable.exc_value.number)
        else:
            before(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        if sys.unraisablehook is hook:
            sys.unraisablehook = before


def ignore_signals() -> None:
    """Ignore SIGINT, SIGTERM and SIGHUP for the rest of the process, so that its exit code stays what it is."""
    for name in ("SIGINT", *TERMINATION):
        if name in signal.Signals.__members__:
            signal.signal(signal.Signals[name], signal.SIG_IGN)


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _send_again(number: int) -> None:
    again = threading.Timer(REDELIVERY_S, _send_to_main_thread, (number,))
    again.daemon = True
    again.start()


def _send_to_main_thread(number: int) -> None:
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)  # wakes it from a wait, too
    else:
        signal.raise_signal(number)


class Terminated(SystemExit):
    """Raised by SIGTERM and SIGHUP; its code is the one by which a shell reports a process that the signal ended."""


def termination_as_exit() -> AbstractContextManager[None]:
    """Have SIGTERM and SIGHUP raise `Terminated`, which leaves `with` blocks.

    A signal that the program handles or ignores itself is left alone.
    """
    return handling(_exit, TERMINATION, only_unhandled=True)


def _exit(number: int, _frame: FrameType | None) -> NoReturn:
    raise Terminated(SIGNALLED + number)
