"""Interrupting a program between two requests."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from nxtdrive.link.link import Link


@contextmanager
def interruptible(link: Link, check: Callable[[], None] | None) -> Iterator[None]:
    """Call `check` before each request and each wait in the block; what it raises reaches the program.

    Args:
        link: The link of the program.
        check: Raises to interrupt; None: nothing interrupts.
    """
    before, link.before_request = link.before_request, check
    try:
        yield
    finally:
        link.before_request = before
