"""A bar on the terminal for work that takes a while."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from nxtdrive.cli.output import make_console

T = TypeVar("T")

SHOWN_AFTER_S = 2.0
"""Work that takes less time gets no bar."""


def with_progress(what: str, clock: Callable[[], float] | None = None) -> Callable[[Sequence[T]], Iterator[T]]:
    """Return a function that passes items on and shows a bar after a while, where standard error is a terminal.

    Args:
        what: Label of the bar, such as the name of the file being made.
        clock: Returns seconds; the console's if None.
    """

    def follow(items: Sequence[T]) -> Iterator[T]:
        from rich.progress import Progress

        console = make_console(stderr=True)
        bar = Progress(console=console, transient=True, disable=not console.is_terminal, get_time=clock)
        try:
            for item in bar.track(items, description=f"making {what}"):
                if (bar.tasks[0].elapsed or 0.0) >= SHOWN_AFTER_S:
                    bar.start()
                yield item
        finally:
            bar.stop()

    return follow
