"""Failures and evidence in words, for the explanation of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from behaviors.events import Reason
from behaviors.evidence import Evidence
from behaviors.failures import Blocker
from behaviors.journal import Record
from behaviors.recoveries import RECOVERIES
from behaviors.target_queue import TargetOutcome
from firmware_protocol.wording import number_of

REASONS: dict[str, str] = {
    Reason.FULL_TURN_WITHOUT_SIGHTING: "a full turn did not bring it into view",
    Reason.NEVER_SEEN: "a scan did not bring it into view",
    Reason.TARGET_LOST: "it went out of view on the way there",
    Reason.LOST_BEHIND: "something came between the robot and it",
    Reason.BLOCKED_SHORT: "something stopped the robot on the way there",
    Reason.BLOCKED_LONG: "something is in the way and does not leave",
    Reason.NO_PROGRESS: "the robot drives and does not come nearer",
    Reason.SLIPPED: "the wheels turn and the robot does not move",
    Reason.WRONG_TARGET: "up close it turned out to be something else",
    Reason.RANGE_MISMATCH: "the sonar contradicts the distance that its apparent size gives",
    Reason.UNCERTAIN: "it is found no more steadily than a look-alike, so the robot looks for a better one first",
    Reason.NO_WAY: "there is no path to where the robot wanted to go",
    Reason.APPROACH_TIMEOUT: "the approach took too long",
    Reason.THERE: "the robot got there",
}
"""What the names of failures mean, and of other reasons that do not say it themselves."""
PARTIAL_VIEWS = {
    "too_near": "it is too near for the camera to see all of it",
    "oblique": "it is seen from too far to the side to be sure that it is the target",
}
"""What was measured of a target that is in view, though not well enough; it counts as lost too."""
OUTAGES = {
    "link": "the link to the brick is lost",
    "camera": "the camera delivers no new frames, or black ones",
    "sensor": "no sensor is left that could stop the robot",
}
"""Why a mission is suspended, by the part that failed."""
MEASURED = {
    "looks": "{:g} looks",
    "stops": "{:g} stops",
    "scan_s": "scanned for {:.1f} s",
    "rescan_s": "looked again for {:.1f} s",
    "waited_s": "waited for {:.1f} s",
    "unseen_s": "not seen for {:.1f} s",
    "range_mm": "sonar {:.0f} mm",
    "distance_mm": "by its size {:.0f} mm",
    "hides": "hides the target",
    "remembered": "it is on the map",
    "sudden": "it appeared suddenly",
    "touching": "it touches the bumper",
    "touched": "the robot touched it",
}
"""How measurements of a failure are written; of those that are yes or no only the first."""
UNITS = {"mm": 0, "s": 1, "deg": 0}
"""Units at the end of names in the journal, and the decimals to show."""


def reason_words(reason: str, evidence: object = None) -> str:
    """Return the meaning of a reason's name, or the name itself; the failure's evidence may make it more precise."""
    if isinstance(evidence, Mapping):
        for name, text in PARTIAL_VIEWS.items():
            if evidence.get(name):
                return text
    return REASONS.get(reason) or spaced(reason)


def target_outcome_words(outcome: str) -> str:
    """Describe how a mission's end changed a target's result: what was pending then has not been reached."""
    return "not reached" if outcome == TargetOutcome.PENDING else spaced(outcome)


def outage_words(record: Record) -> str:
    """Describe what a suspended mission waits for, and for how much longer."""
    return f"{OUTAGES[str(record.data['part'])]}; waiting for {record.data['left_s']:.0f} s more"


def measured_words(measured: Mapping[str, object]) -> str:
    """Write measurements of the journal with their units: ``range_mm`` 620 is "sonar 620 mm".

    What `reason_words` says already is left out.
    """
    return ", ".join(
        filter(None, (_measured(name, value) for name, value in measured.items() if name not in PARTIAL_VIEWS))
    )


def _measured(name: str, value: object) -> str:
    if isinstance(value, bool):
        return MEASURED.get(name, spaced(name)) if value else ""
    if not isinstance(value, int | float):
        return ""
    if name in MEASURED:
        return MEASURED[name].format(value)
    stem, _, unit = name.rpartition("_")
    if unit not in UNITS:
        return f"{spaced(name)} {value:g}"
    return f"{spaced(stem)} {value:.{UNITS[unit]}f} {unit}"


def state_words(name: str) -> str:
    """Write a recovery, or the state of that name, as the map does: "look elsewhere" for "move_to"; others spaced."""
    return RECOVERIES[name].label if name in RECOVERIES else spaced(name)


def spaced(name: str) -> str:
    """Write a name from the journal as words."""
    return name.replace("_", " ")


def bearing_words(bearing_deg: float) -> str:
    """Return a direction, positive right: "12° to the right", or "straight ahead" within a degree."""
    side = "right" if bearing_deg > 0 else "left"
    return f"{abs(bearing_deg):.0f}° to the {side}" if abs(bearing_deg) >= 1 else "straight ahead"


def evidence_lines(evidence: Evidence) -> Iterator[str]:
    """Yield what was known, one sentence per line, with its numbers."""
    seen = "has been recognised" if evidence.seen_since_search else "has not been recognised"
    again = f"searched for again {_times(evidence.researches)}" if evidence.researches else "not searched for again yet"
    yield f"{evidence.target} {seen} since the last search began; {again}"
    if evidence.spent_s:
        yield f"pursued for {evidence.spent_s:.0f} s without a sighting that still counts"
    if evidence.round > 1 or evidence.targets_left > 1:
        yield f"round {evidence.round}; targets not reached yet: {evidence.targets_left}"
    if evidence.blocker:
        yield _blocker_words(evidence.blocker)
        yield _detour_words(evidence)
    if evidence.blocked:
        yield f"beyond it a place to look from: {_map_chance(evidence.blocked.chance)}"
    if evidence.here:
        yield f"another look from here: {evidence.here.seconds:.0f} s, {_map_chance(evidence.here.chance)}"
    if evidence.viewpoints:
        best = max(each.chance for each in evidence.viewpoints)
        nearest = min(each.travel_s for each in evidence.viewpoints)
        places = number_of(len(evidence.viewpoints), "other place")
        yield f"{places} to look from: nearest in {nearest:.0f} s, at best {_map_chance(best)}"
    if evidence.blocked or evidence.here or evidence.viewpoints:
        yield "the candidates' chances are corrected by the outcomes of earlier missions"
    for other in evidence.others:
        seen = f"was seen {other.age_s:.0f} s ago, {other.travel_s:.0f} s from here"
        yield f"{other.target} {seen}; it is still there with a chance of {other.chance:.0%}"
    if evidence.failures > 1:
        yield f"failed here for this reason {_times(evidence.failures)}"
    if tried := [f"{state_words(kind)} {_times(count)}" for kind, count in evidence.repeats.items() if count]:
        yield f"tried here already: {', '.join(tried)}"


def _blocker_words(blocker: Blocker) -> str:
    seen = "hides the target" if blocker.hides else "the target can be seen past it"
    moves = "moves" if blocker.moving else "does not move"
    known = f"known for {blocker.age_s:.0f} s" if blocker.age_s else "new"
    away = f"{blocker.range_mm:.0f} mm away, {bearing_words(blocker.bearing_deg)}"
    return f"in the way, {away}: {known}, {moves}, {seen}"


def _detour_words(evidence: Evidence) -> str:
    if evidence.detour is None:
        return "no path around it is known"
    unknown_mm = round(evidence.detour.unknown_mm, -2)
    over = f" and crosses {unknown_mm:.0f} mm of unknown floor" if unknown_mm else ""
    return f"a path around it takes {evidence.detour.extra_s:.0f} s longer{over}"


def _map_chance(chance: float) -> str:
    return f"{chance:.0%} chance by the map alone"


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")
