"""A rich console for untrusted text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NoReturn

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from firmware_protocol.printable import printable_lines


class SafeConsole(Console):
    """Escapes what a terminal would interpret in any text; colours and cursor movements are rich's own.

    A reader that has left raises `BrokenPipeError`, as elsewhere; rich itself would exit with code 1.
    """

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as rich does, with the text escaped."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(printable_lines(segment.text), segment.style)

    def on_broken_pipe(self) -> NoReturn:
        """Draw no more, and raise the error again."""
        self.quiet = True
        raise  # noqa: PLE0704 - rich calls this where it has caught the error
