"""What brings the radio's answers to the firmware, among other bytes. Source: docs/firmware.md section 10."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from sim_backend.firmware.radio_answers import Change

LOST_MS = 499
"""From an answer that is not recognised to the end of its operation."""

STARTS_AGAIN_MS = 4950
"""From the first answer of a start, if it is not recognised, to that of the next start."""

UNENDING_MS = 1_000_000_000
"""Duration of an operation that never ends."""


class Line(Protocol):
    """The line, outside of stream mode."""

    def is_obstructed(self, at_ms: int) -> bool:
        """Return whether bytes of other messages come before an answer of that time."""

    def append(self, at_ms: int, answer: bytes) -> None:
        """Bring an answer after these bytes."""

    def clear(self, before_ms: int) -> None:
        """Drop all bytes of incomplete messages that came before a time."""


class Held(NamedTuple):
    """An operation that waits for an answer behind other bytes.

    Attributes:
        answer: The answer.
        changes: What follows it.
        busy_until_ms: When the operation would be over.
    """

    answer: Change
    changes: Sequence[Change]
    busy_until_ms: float
