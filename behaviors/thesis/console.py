"""The thesis's console: the lines its agent `client2` printed, word for word.

Source: docs/thesis.md, console; figures 1 and 7.
"""

from __future__ import annotations

from collections.abc import Callable

from behaviors.journal import Record, RecordKind
from behaviors.thesis.skills import ArriveReply

PREFIX = "[client2] "

_ANSWERS: dict[object, str] = {ArriveReply.CONTINUE.value: "Continue...", ArriveReply.FAILED.value: "Failed"}


class Console:
    """Turns records into the agent's lines.

    Args:
        write: Takes one line, without its end.
    """

    def __init__(self, write: Callable[[str], None]) -> None:
        self._write = write

    def say(self, text: str) -> None:
        """Print one line as the agent does."""
        self._write(PREFIX + text)

    def __call__(self, record: Record) -> None:
        """Print what a record says."""
        line = _line(record)
        if line:
            self.say(line)


def _line(record: Record) -> str | None:
    data = record.data
    if record.kind is RecordKind.CALL and data["verb"] == "arrive":
        return f"Arriving at {record.target}"
    if record.kind is RecordKind.REPLY and data["verb"] == "arrive":
        return _ANSWERS.get(data["value"])
    # when the last target is given up there is nothing to change to
    if record.kind is RecordKind.TRANSITION and data["source"] in ("left", "gave_up") and data["to"] == "search":
        return "change target!"
    return None
