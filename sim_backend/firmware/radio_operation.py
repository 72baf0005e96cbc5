"""An operation of the Bluetooth radio. Source: docs/firmware.md section 10."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from sim_backend.firmware.radio_answers import Change

STREAM_ENDS_MS = 102
"""From a command in stream mode to the radio's earliest answer."""

_LEAVES_MS = 97
"""From the last telegram that counts to the pass in which the firmware leaves stream mode."""

TIME_OUT_MS = 494
"""Additional time for which the firmware waits for an answer that does not arrive."""

SILENT_MS = 504
"""How long the firmware waits for the answer of a radio that is off."""


class Operation(NamedTuple):
    """An operation of the radio, as it runs without stream mode. Times count from the command.

    Attributes:
        began_ms: When the command arrived.
        answer_ms: The radio's first answer.
        late_ms: How much later the firmware sees it if the radio leaves stream mode after `STREAM_ENDS_MS`.
        duration_ms: How long the radio is busy.
        changes: The changes that the answers make.
        stream_lasts_ms: How long telegrams of a stream still count.
    """

    began_ms: int
    answer_ms: int
    late_ms: int
    duration_ms: int
    changes: tuple[Change, ...]
    stream_lasts_ms: float

    @property
    def over_ms(self) -> int:
        """The pass from which on stream mode no longer holds it up: that of its first answer, if it has one."""
        first_ms = self.changes[0].at_ms if self.changes else 0
        return self.began_ms + min(STREAM_ENDS_MS, STREAM_ENDS_MS - self.answer_ms + first_ms)

    @property
    def leaves_ms(self) -> float:
        """When the firmware leaves stream mode if the radio has left it before; 0 if it stays in it."""
        return self.began_ms + _LEAVES_MS + self.stream_lasts_ms if self.stream_lasts_ms < inf else 0


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
