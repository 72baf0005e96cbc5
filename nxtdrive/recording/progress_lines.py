"""The lines that `nxtdrive run` prints while a mission runs: when, what the robot does, and why."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from behaviors.events import Event, Reason
from behaviors.journal import Record, RecordKind
from behaviors.recoveries import choice_from
from nxtdrive.recording.wording import bearing_words, outage_words, reason_words, spaced

BACK: dict[object, str] = {
    Event.LINK_BACK: "the brick answers again",
    Event.CAMERA_BACK: "the camera works again",
    Event.SENSOR_BACK: "a sensor answers again",
}
RETREATS: dict[str, str] = {
    Reason.CONTACT: "it touched something",
    Reason.STALLED: "something holds its wheels",
}
INDENT = " " * 11
UNKNOWN_FORM = (KeyError, TypeError, ValueError, AttributeError)
"""Raised for a record of an unknown form, such as another version's."""


class ProgressLines:
    """Turns the records of a mission into lines for people.

    Args:
        write: Takes one line, without its end.
    """

    def __init__(self, write: Callable[[str], None]) -> None:
        self._write = write
        self._choice = ""

    def __call__(self, record: Record) -> None:
        """Print what a record says, if it says something new."""
        for number, line in enumerate(self.lines(record)):
            self._write(f"{INDENT}{line}" if number else f"{record.time_s:7.1f} s  {line}")

    def lines(self, record: Record) -> Iterator[str]:
        """Yield what a record says, without its time."""
        data = record.data
        match record.kind:
            case RecordKind.CHOICE:  # the failure that it answers comes with the next record
                self._choice = f"{_choice_words(data)}: {data['why']}"
            case RecordKind.TRANSITION if data["to"] == "select":
                yield f"{record.target}: {reason_words(str(data.get('reason', 'failed')), data.get('evidence'))}"
                yield f"-> {self._choice}"
            case RecordKind.TRANSITION:
                yield from _transition(record.target, data)
            case RecordKind.OUTAGE:
                yield f"suspended: {outage_words(record)}"
            case RecordKind.SENSOR if data["answers"]:
                yield f"the {data['sensor']} answers again"
            case RecordKind.SENSOR:
                yield f"continuing without the {data['sensor']}: {data['error']}"


def _choice_words(data: Mapping[str, Any]) -> str:
    """Describe a choice; name one that this version does not know."""
    try:
        return choice_from(data).words()
    except (KeyError, TypeError, ValueError):
        return spaced(str(data["choice"]))


def _transition(target: str, data: Mapping[str, Any]) -> Iterator[str]:
    match data["to"], data["event"]:
        case "search", event if event != Event.RESUME:
            yield f"searching for {target}"
        case "arrive", Event.TARGET_SEEN:
            yield f"{target} seen{_where(data['evidence'].get('sighting'))}; driving to it"
        case "verify", Event.DOUBTED:
            yield f"{target}: standing in front of it to make sure that it is the target"
        case "retreat", Event.BACKING_OFF:
            yield f"backing off: {RETREATS.get(str(data.get('reason')), 'something is in the way')}"
        case "distrusted", Event.MAP_DISTRUSTED:
            yield "the map shows no path past the obstacle; relying on camera and sonar for now"
        case "slipping", _:
            yield f"the {data['evidence']['wheel']} wheel slips; going by what the camera shows"
        case "gripping", Event.WHEEL_GRIPS:
            yield f"the {data['evidence']['wheel']} wheel grips again after {data['evidence']['slipped_s']:.0f} s"
        case "gave_up", _:
            yield f"{target} given up after the last round"
        case "reached", _:
            yield f"{target} reached"
        case "suspended", _ if data.get("reason") == Reason.OPERATOR_PAUSE:
            yield "paused"
        case _ if data.get("reason") == Reason.OPERATOR_RESUME:
            yield "resumed"
        case "down", _:
            yield str(data["evidence"]["error"])
        case "tripped", _ if data.get("reason") == Reason.WRONG_WIRING:
            yield str(data["evidence"]["error"])
        case "up", event if event in BACK:
            yield f"{BACK[event]} after {data['evidence']['silent_s']:.1f} s; continuing"


def lines_of(records: Sequence[Record]) -> list[tuple[float, str]]:
    """Return what `nxtdrive run` printed, each line with its time; records of an unknown form are left out."""
    lines: list[tuple[float, str]] = []
    now_s = 0.0
    progress = ProgressLines(lambda text: lines.append((now_s, text)))
    for record in records:
        now_s = record.time_s
        with suppress(*UNKNOWN_FORM):
            progress(record)
        if record.kind is RecordKind.END:
            lines.append((now_s, spaced(str(record.data.get("ending", "ended")))))
    return lines


def equipment_lines(records: Sequence[Record]) -> list[tuple[float, str]]:
    """Return what `nxtdrive run` printed about parts of the robot that failed or worked again, and when."""
    lines: list[tuple[float, str]] = []
    progress = ProgressLines(lambda _: None)
    for record in records:
        if record.kind is RecordKind.SENSOR or _is_outage(record):
            with suppress(*UNKNOWN_FORM):
                lines += [(record.time_s, line) for line in progress.lines(record)]
    return lines


def _is_outage(record: Record) -> bool:
    return record.kind is RecordKind.TRANSITION and record.data.get("to") in ("down", "up")


def _where(sighting: Mapping[str, float] | None) -> str:
    if sighting is None:
        return ""
    at_most = "at most " if sighting.get("bound") else ""
    return f" {at_most}{sighting['distance_mm'] / 1000:.1f} m away, {bearing_words(sighting['bearing_deg'])}"
