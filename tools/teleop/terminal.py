"""The terminal that the screen is drawn on, which may be closed while the program runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO


class TolerantStream:
    """A stream that never fails: from its first error on it drops all text.

    A thread of textual writes to the terminal. If an error ended it, the program would wait for it forever.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._gone = False

    def write(self, text: str) -> int:
        """Write a text, if the terminal is still there."""
        self._do(lambda: self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Write what is still buffered, if the terminal is still there."""
        self._do(self._stream.flush)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the stream has
        return getattr(self._stream, name)

    def _do(self, write: Callable[[], object]) -> None:
        if not self._gone:
            try:
                write()
            except (OSError, ValueError):  # the latter of a stream that is closed
                self._gone = True


@contextmanager
def tolerant_terminal() -> Iterator[None]:
    """Have textual, which draws on Python's own standard error, draw on a `TolerantStream`."""
    before = sys.__stderr__
    assert before is not None  # noqa: S101 - `nxtdrive teleop` has checked that there is a terminal
    sys.__stderr__ = TolerantStream(before)  # type: ignore[assignment, misc] # it has all that textual uses
    try:
        yield
    finally:
        sys.__stderr__ = before  # type: ignore[misc]
