"""The journal: what happened, one record after the other.

All observers of a mission (the journal file, the console, the status line, the video's caption, the map) receive the
same records. These carry mission time only, so that the same seed gives the same bytes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from numbers import Integral, Real
from typing import Protocol, Self

from input_files.json_text import parse_object

JOURNAL_FORMAT = 3
"""Format of the journals that this version writes; docs/journal.md lists the formats. Journals of format 1 have no
entry for it."""

MAX_TIME_S = 1e9
"""Longest mission time, thirty years: the formats to which a run is exported can represent it."""

Value = str | int | float | bool | None | list["Value"] | dict[str, "Value"]


class RecordKind(StrEnum):
    """What a record is about."""

    START = "start"
    TRANSITION = "transition"
    CALL = "call"
    REPLY = "reply"
    LOOK = "look"
    ECHO = "echo"
    STEP = "step"
    CHOICE = "choice"
    SENSOR = "sensor"
    OUTAGE = "outage"
    END = "end"


@dataclass(frozen=True, slots=True)
class Record:
    """One thing that happened.

    Attributes:
        time_s: Mission time, seconds, rounded to the millisecond.
        kind: What it is about.
        state: State of the mission region when it happened.
        target: The target being pursued.
        data: Further values; their keys depend on the kind and are documented in docs/journal.md.
    """

    time_s: float
    kind: RecordKind
    state: str
    target: str
    data: Mapping[str, Value] = field(default_factory=dict)

    @classmethod
    def of(cls, time_s: float, kind: RecordKind, state: str, target: str, data: Mapping[str, object]) -> Self:
        """Return a record of a time not yet rounded, and of data that `plain` converts."""
        return cls(round(time_s, 3), kind, state, target, {key: plain(value) for key, value in data.items()})

    def to_json(self) -> str:
        """Return one line of ``journal.jsonl``, without its end."""
        return json.dumps(self.values(), ensure_ascii=False)

    def values(self) -> dict[str, Value]:
        """Return it as plain values with the journal's keys, in a fixed order."""
        head = {"t": self.time_s, "kind": self.kind.value, "state": self.state, "target": self.target}
        return {**head, **self.data}

    @classmethod
    def from_json(cls, line: str) -> Self:
        """Read a line as `to_json` writes it.

        Raises:
            ValueError: It is not a record.
        """
        data = parse_object(line)
        time_s, kind, state, target = (data.pop(name, None) for name in ("t", "kind", "state", "target"))
        if not isinstance(time_s, int | float) or not isinstance(state, str) or not isinstance(target, str):
            raise ValueError("not a record of a journal")  # noqa: TRY004 - as for text that is not JSON
        if isinstance(time_s, bool) or not 0 <= time_s <= MAX_TIME_S:
            raise ValueError("a time out of range")
        return cls(float(time_s), RecordKind(kind), state, target, data)


def start_of(records: Sequence[Record]) -> Record | None:
    """Return the record of the mission's start; None if it did not begin."""
    return next((record for record in records if record.kind is RecordKind.START), None)


def end_of(records: Sequence[Record]) -> Record | None:
    """Return the record of the mission's end; None if it was killed or is in progress."""
    return next((record for record in reversed(records) if record.kind is RecordKind.END), None)


Observer = Callable[[Record], None]


class Note(Protocol):
    """Writes a record with the current time, state and target."""

    def __call__(self, kind: RecordKind, **data: object) -> None:
        """Write a record; values are converted by `plain`."""
        ...


def plain(value: object) -> Value:
    """Convert a value for JSON: numbers rounded to three decimals, those that are not finite to None, enums to text.

    Raises:
        TypeError: There is no plain form; the journal takes measurements, not objects.
    """
    if isinstance(value, bool | None):
        return value
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Integral):  # also numpy's
        return int(value)
    if isinstance(value, Real):
        return round(float(value), 3) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    raise TypeError(f"{value!r} cannot be written into a journal")
