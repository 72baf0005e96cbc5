"""The events of a run that get a number on its map, with the words of the printed lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from behaviors.events import Event
from behaviors.journal import Record, RecordKind
from behaviors.ports import Pose
from behaviors.recoveries import CHANGE_TARGET, RECOVERIES, Recovery
from nxtdrive.recording.progress_lines import UNKNOWN_FORM, ProgressLines

MAX_NUMBERS = 16
"""Numbers on a map, at most."""
QUIET = ("search", "verify", "gave_up", "distrusted", "gripping")
"""States into which a transition gets no number: the event that led to it has one."""
LAST = 3
"""The last events have numbers in any case: they show how a mission ended."""
SAME_PLACE_MM = 300.0
"""Where there are more events than numbers, equal ones no farther apart than this share one."""


@dataclass(frozen=True, slots=True)
class MapEvent:
    """Something that happened at a place.

    Attributes:
        time_s: Mission time.
        pose: Where the robot was.
        kind: ``failed``, ``reached``, ``seen``, ``retreat``, ``outage`` or ``other``.
        words: What, as the printed lines say it: one line, of a failure two.
        same: Equal for events of one kind: the kind, the target, and of a failure its name and the choice.
        recovery: What was chosen after a failure.
    """

    time_s: float
    pose: Pose
    kind: str
    words: tuple[str, ...]
    same: tuple[str, ...]
    recovery: Recovery | None = None

    @property
    def important(self) -> bool:
        """Whether it is an arrival, a target that is left, or an outage."""
        return self.kind in ("reached", "outage") or self.recovery is CHANGE_TARGET


@dataclass(slots=True)
class EventGroup:
    """Events that share a number: one, or equal ones at one place."""

    events: list[MapEvent] = field(default_factory=list)

    @property
    def first(self) -> MapEvent:
        """The earliest."""
        return self.events[0]

    @property
    def when(self) -> str:
        """Describe when they happened, and how often."""
        start = f"{self.first.time_s:.1f} s"
        if len(self.events) == 1:
            return start
        return f"{start} to {self.events[-1].time_s:.1f} s, {len(self.events)} times"


@dataclass(frozen=True, slots=True)
class Numbering:
    """Which events have numbers.

    Attributes:
        numbered: In the order of their numbers, from 1; by the time of their first events.
        rest: The words of the others, with their count, the most frequent first.
    """

    numbered: tuple[EventGroup, ...]
    rest: tuple[tuple[str, int], ...]


class EventReader:
    """Finds the events among the records of a run, which it receives in order."""

    def __init__(self) -> None:
        self._progress = ProgressLines(lambda _: None)
        self._choice = ""

    def read(self, record: Record, pose: Pose) -> MapEvent | None:
        """Return the event that a record is, if it is one."""
        try:
            words = tuple(self._progress.lines(record))
        except UNKNOWN_FORM:
            return None
        if record.kind is RecordKind.CHOICE:
            self._choice = str(record.data["choice"])
            return None
        if not words or record.data.get("to") in QUIET:
            return None
        kind, detail, recovery = _kind(record), "", None
        if kind == "failed":
            recovery = RECOVERIES.get(self._choice)
            detail = f"{record.data.get('reason')} {self._choice}"
        elif kind not in ("seen", "reached"):
            detail = words[0].partition(";")[0]
        return MapEvent(record.time_s, pose, kind, words, (kind, record.target, detail), recovery)


def _kind(record: Record) -> str:
    if record.kind is RecordKind.OUTAGE or record.data.get("to") in ("suspended", "down"):
        return "outage"
    known = {"select": "failed", "reached": "reached", "retreat": "retreat"}
    seen = record.data.get("event") == Event.TARGET_SEEN
    return "seen" if seen else known.get(str(record.data.get("to")), "other")


def numbering(events: Sequence[MapEvent]) -> Numbering:
    """Choose which events get numbers.

    Up to `MAX_NUMBERS` events all do. If there are more, equal ones within `SAME_PLACE_MM` share a number; if there are
    still too many, the `LAST` events come first, then the first of each kind, then the second of each, and so on.
    Ties go to arrivals, targets left and outages, then to the earliest.
    """
    groups = [EventGroup([event]) for event in events] if len(events) <= MAX_NUMBERS else _grouped(events)
    seen: Counter[tuple[str, ...]] = Counter()
    ranked = []
    for group in groups:
        repeat = -1 if group.events[-1] in events[-LAST:] else seen[group.first.same]
        ranked.append((repeat, not group.first.important, group.first.time_s, group))
        seen[group.first.same] += 1
    ranked.sort(key=lambda each: each[:3])
    chosen = sorted((each[3] for each in ranked[:MAX_NUMBERS]), key=lambda group: group.first.time_s)
    left = (event for each in ranked[MAX_NUMBERS:] for event in each[3].events)
    return Numbering(tuple(chosen), tuple(_counted(left)))


def _counted(events: Iterable[MapEvent]) -> list[tuple[str, int]]:
    """Count equal events; equal ones may differ in numbers, and the words of the earliest stand for all."""
    words: dict[tuple[str, ...], str] = {}
    counts: Counter[tuple[str, ...]] = Counter()
    for event in sorted(events, key=lambda each: each.time_s):
        choice = f" -> {event.recovery.label}" if event.recovery else ""
        words.setdefault(event.same, event.words[0] + choice)
        counts[event.same] += 1
    return [(words[same], count) for same, count in counts.most_common()]


def _grouped(events: Sequence[MapEvent]) -> list[EventGroup]:
    groups: list[EventGroup] = []
    for event in events:
        group = next((each for each in groups if _shares(event, each.first)), None)
        if group is None:
            groups.append(group := EventGroup())
        group.events.append(event)
    return groups


def _shares(event: MapEvent, first: MapEvent) -> bool:
    return event.same == first.same and event.pose.distance_mm_to(first.pose) <= SAME_PLACE_MM
