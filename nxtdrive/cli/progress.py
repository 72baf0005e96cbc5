"""A bar on the terminal for work that takes a while."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from nxtdrive.cli.output import make_console

T = TypeVar("T")


def with_progress(what: str) -> Callable[[Sequence[T]], Iterator[T]]:
    """Return a function that passes items on and meanwhile shows a bar, where standard error is a terminal.

    Args:
        what: What is being made, such as the name of a file.
    """

    def follow(items: Sequence[T]) -> Iterator[T]:
        from rich.progress import track

        console = make_console(stderr=True)
        yield from track(items, f"making {what}", console=console, transient=True, disable=not console.is_terminal)

    return follow
