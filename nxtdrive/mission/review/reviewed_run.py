"""What the hints about a run are drawn from: its mission, its records so far, and in the simulator the truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from behaviors.journal import Record
from behaviors.plausibility import contradicts
from nxtdrive.mission.detectors import build_detectors
from nxtdrive.mission.truth import Truth, recognised

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from nxtdrive.vision.detection import TargetDetector

Hints = Iterator[tuple[str, str]]
"""Of each the target that it is about, or an empty text; and what to check or change, in one sentence or two."""
Distances = tuple[float, float]
"""By the sonar and by the size in the picture, in millimetres."""


class Transition:
    """What the record of a transition says.

    Attributes:
        target: The target being pursued.
        event: What happened.
        reason: Why.
        evidence: What the skill measured; empty if it reports nothing, as one of another package may.
        sighting: The sighting in that evidence; likewise.
    """

    def __init__(self, record: Record) -> None:
        data = cast("Mapping[str, Any]", record.data)
        self.target, self.event, self.reason = record.target, data.get("event"), data.get("reason")
        self.evidence: Mapping[str, Any] = data.get("evidence", {})
        self.sighting: Mapping[str, Any] = self.evidence.get("sighting", {})


@dataclass
class ReviewedRun:
    """A run that is under way.

    Attributes:
        mission: What the robot does.
        truth: Of a simulated world, or None.
        file: The mission's file, for the command in a hint; None for the built-in one.
        by_name: Whether a target is the simulated world's object of its name, whatever that looks like.
        camera: The camera's source, for the command in a hint.
        world: The file or the name of the simulated world; empty for the default one.
        arrivals: For each target that was reached: ``target``, ``time_s``, ``believed_mm`` by its size or None,
            ``sonar_mm`` or None; in the simulator also ``true_mm`` and ``there``, whether it really stands in front of
            the target.
        seen: The targets that were seen.
        look: Data of the last look; empty before the first.
        weak_battery: Whether the battery was found to be weak.
        link_losses: How often the link was lost.
        wheel_slipped: Whether a wheel that slipped for long was reported.
        stops: For each target, the distances at which the robot was stopped although the target looked farther away.
    """

    mission: Mission
    truth: Truth | None
    file: Path | None = None
    by_name: bool = False
    camera: str = "0"
    world: str = ""
    arrivals: list[dict[str, Any]] = field(default_factory=list, init=False)
    seen: set[str] = field(default_factory=set, init=False)
    look: Mapping[str, Any] = field(default_factory=dict, init=False)
    weak_battery: bool = field(default=False, init=False)
    link_losses: int = field(default=0, init=False)
    wheel_slipped: bool = field(default=False, init=False)
    stops: dict[str, list[Distances]] = field(default_factory=lambda: defaultdict(list), init=False)
    _lookalikes: dict[str, list[str]] = field(default_factory=dict, init=False)

    def learn_look(self, record: Record) -> None:
        """Learn from a look."""
        self.look = record.data
        if record.data["sighting"] is not None:
            self.seen.add(record.target)

    def learn_arrival(self, transition: Transition, time_s: float) -> None:
        """Learn from an arrival at this mission time."""
        target, believed_mm = transition.target, transition.sighting.get("distance_mm")
        arrival = {"target": target, "time_s": time_s, "believed_mm": believed_mm}
        arrival["sonar_mm"] = self.look.get("range_mm")
        self.arrivals.append(arrival | self._compared_with_truth(target, believed_mm))

    @property
    def reached(self) -> set[str]:
        """The targets that were reached."""
        return {arrival["target"] for arrival in self.arrivals}

    def lookalikes(self, target: str) -> list[str]:
        """Return the names of the objects of the simulated world that pass for a target; none without the truth."""
        if self.truth is None:
            return []
        if target not in self._lookalikes:
            known = [target] if self.by_name else recognised(self.detectors[target].detector, self.truth)
            self._lookalikes[target] = known
        return self._lookalikes[target]

    @cached_property
    def detectors(self) -> dict[str, TargetDetector]:
        """The detectors by target."""
        return build_detectors(self.mission)

    def _compared_with_truth(self, target: str, believed_mm: float | None) -> dict[str, object]:
        """Compare an arrival with the truth: with the object in view that is the target, else the nearest such."""
        if (truth := self.truth) is None:
            return {}
        names = self.lookalikes(target)
        objects = sorted((not truth.in_front_of_camera(name), truth.lens_distance_mm(name)) for name in names)
        if not objects:
            return {"true_mm": None, "there": False}
        hidden, true_mm = objects[0]
        there = not hidden and (believed_mm is None or not contradicts(true_mm, believed_mm))
        return {"true_mm": round(true_mm, 1), "there": there}
