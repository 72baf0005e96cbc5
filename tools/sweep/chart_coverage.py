"""Which of the chart's transitions the missions of a sweep took."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from behaviors.diagram import arrows
from behaviors.events import Event
from behaviors.journal import Record, RecordKind

from .mission_result import MissionResult


def taken(records: Iterable[Record]) -> list[str]:
    """Return the transitions that a journal shows, by name; none if it is not the chart's, as those of baselines."""
    data = [record.data for record in records if record.kind is RecordKind.TRANSITION]
    if not any(each.get("event") == Event.START for each in data):
        return []
    return sorted({_name(str(each["source"]), str(each["event"] or ""), str(each["to"])) for each in data})


def transitions() -> list[str]:
    """Return the names of all transitions, in the order of the chart."""
    return list(dict.fromkeys(_name(each.source, each.event, each.target) for each in arrows()))


def never(results: Sequence[MissionResult]) -> tuple[list[str], int]:
    """Return the transitions that no mission took, in the order of the chart, and the number of all."""
    names = transitions()
    found = {name for result in results for name in result.transitions}
    return [name for name in names if name not in found], len(names)


def coverage_words(results: Sequence[MissionResult]) -> str:
    """Report how much of the chart the missions covered; nothing if no mission ran on it."""
    if not any(result.transitions for result in results):
        return ""
    missing, number = never(results)
    rest = f"; never: {', '.join(missing)}" if missing else ""
    return f"chart: {number - len(missing)} of {number} transitions taken{rest}"


def _name(source: str, event: str, target: str) -> str:
    """Name a transition: no two of one state have the same event, or, without an event, the same target."""
    return f"{source}: {event}" if event else f"{source} -> {target}"
