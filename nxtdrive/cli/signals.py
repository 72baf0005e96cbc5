"""Signals that end a server, as something it can ask for where that suits it."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable, Iterator

ENDING_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
"""Those that end the server in good order, where the system has them."""


@contextlib.contextmanager
def until_signal() -> Iterator[Callable[[], bool]]:
    """A question that is answered with yes once the user or the system wants an end."""
    wanted = False

    def end(*_: object) -> None:
        nonlocal wanted
        wanted = True

    with handling(end):
        yield lambda: wanted


@contextlib.contextmanager
def handling(handler: Callable[..., None]) -> Iterator[None]:
    """Have the signals that end programs call `handler` instead."""
    signals = [getattr(signal, name) for name in ENDING_SIGNALS if hasattr(signal, name)]
    before = {number: signal.signal(number, handler) for number in signals}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)
