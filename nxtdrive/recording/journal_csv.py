"""A journal as a table: one row per record, one unit per column."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from behaviors.journal import Record
from input_files.plain import is_number
from nxtdrive.recording.csv_table import csv_text

POSE = ("x_mm", "y_mm", "heading_deg")
SIGHTING = ("bearing_deg", "distance_mm", "confidence")
TEXTS = ("source", "to", "event", "reason", "choice", "why", "what", "stop", "ending")
NUMBERS = ("range_mm", "turned_deg", "battery_mv")
COLUMNS = (
    *("t_s", "kind", "state", "target"),
    *POSE,
    *(f"sighting_{name}" for name in SIGHTING),
    *("step_mm", *NUMBERS),
    *TEXTS,
    "more",
)


def journal_csv(records: Iterable[Record]) -> str:
    """Return the records as CSV; the last column has all values without a column of their own, as JSON."""
    return csv_text(COLUMNS, map(_row, records))


def _row(record: Record) -> dict[str, object]:
    left: dict[str, Any] = dict(record.data)
    row: dict[str, object] = {"t_s": record.time_s, "kind": record.kind.value}
    row |= {"state": record.state, "target": record.target}
    for name in (*TEXTS, *NUMBERS):
        value = left.get(name)
        if isinstance(value, str) if name in TEXTS else is_number(value):
            row[name] = left.pop(name)
    left = {name: value for name, value in left.items() if value is not None}
    if is_number(left.get("distance_mm")):
        row["step_mm"] = left.pop("distance_mm")
    pose = left.get("pose")
    if isinstance(pose, list) and len(pose) == len(POSE) and all(map(is_number, pose)):
        row |= dict(zip(POSE, left.pop("pose"), strict=True))
    sighting = left.get("sighting")
    if isinstance(sighting, Mapping):
        numbers = {name: sighting[name] for name in SIGHTING if is_number(sighting.get(name))}
        row |= {f"sighting_{name}": value for name, value in numbers.items()}
        left["sighting"] = {name: value for name, value in sighting.items() if name not in numbers}
    row["more"] = json.dumps(left, ensure_ascii=False) if left else None
    return row
