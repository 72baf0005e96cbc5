"""Watches a mission by the simulation's truth and keeps what is needed to judge it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from behaviors.executive import Ending
from behaviors.journal import Kind, Record
from sim_backend.simulation import Simulation
from sim_backend.world.truth import TruePose

from .floor_plan import FloorPlan, Goal
from .survey import survey

SAMPLE_MS = 100
"""Sampling period of the truth."""
JUDGED = (Kind.START, Kind.TRANSITION, Kind.CHOICE, Kind.END)
"""Records that are kept with the truth of their moment."""


@dataclass(frozen=True, slots=True)
class Scene:
    """The places of everything.

    Attributes:
        plan: Everything.
        goals: The pictures that were there, by name.
    """

    plan: FloorPlan
    goals: dict[str, Goal]


@dataclass(frozen=True, slots=True)
class Moment:
    """The truth at one time.

    Attributes:
        time_s: Mission time.
        pose: Of the robot.
        contacts: How often it has touched something so far.
        scene: The places of everything; the same object while nothing moves.
    """

    time_s: float
    pose: TruePose
    contacts: int
    scene: Scene


@dataclass(frozen=True, slots=True)
class Mark:
    """A record of the journal, and the truth when it was written."""

    record: Record
    moment: Moment


@dataclass(frozen=True, slots=True)
class Disturbance:
    """An event that hinders the robot on its way to a target.

    Attributes:
        time_s: When it began.
        target: The target it concerns; an empty string for all of them.
        blocker: Name of the object that blocks the way once it has arrived; empty if the event acts at once.
    """

    time_s: float
    target: str
    blocker: str


@dataclass(frozen=True, slots=True)
class EpisodeTrace:
    """The ground truth of one mission from start to end.

    Attributes:
        targets: Names in order.
        moments: Samples of the truth, one every `SAMPLE_MS`.
        marks: The judged records.
        disturbances: What hindered the robot.
        late_objects: Names of the objects that appeared after the start.
        view_mm: From how far a print can be recognised in this scenario.
        ending: How it ended.
        duration_s: How long it took.
        error: The outage that ended it, in words, or an empty string.
    """

    targets: Sequence[str]
    moments: Sequence[Moment]
    marks: Sequence[Mark]
    disturbances: Sequence[Disturbance]
    late_objects: frozenset[str]
    view_mm: float
    ending: Ending
    duration_s: float
    error: str = ""


class Referee:
    """Records the truth of a mission; an observer of its journal.

    Args:
        simulation: Where it is performed; the mission begins now.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._start_ms = simulation.now_ms
        self._known: tuple[object, Scene] | None = None
        self.moments: list[Moment] = []
        self.marks: list[Mark] = []
        self.records: list[Record] = []
        self._watch()

    def __call__(self, record: Record) -> None:
        """Keep a record, with the truth if it is judged."""
        self.records.append(record)
        if record.kind in JUDGED:
            self.marks.append(Mark(record, self._moment()))

    def disturbances(self) -> Iterator[Disturbance]:
        """The disturbances so far."""
        events = {event.name: event for event in self._simulation.world_file.events}
        for time_s, name in self._simulation.truth.events:
            event = events[name]
            if event.picture or event.blocks:
                target, blocker = event.picture or event.blocks or "", "" if event.picture else event.subject
                yield Disturbance(time_s - self._start_ms / 1000, target, blocker)
        for start_ms, _ in self._simulation.webcam.unplugged_ms:
            yield Disturbance((start_ms - self._start_ms) / 1000, "", "")

    def _watch(self) -> None:
        self.moments.append(self._moment())
        self._simulation.at(self._simulation.now_ms + SAMPLE_MS, self._watch)

    def _moment(self) -> Moment:
        truth = self._simulation.truth
        time_s = (self._simulation.now_ms - self._start_ms) / 1000
        return Moment(time_s, truth.pose, truth.contacts, self._scene())

    def _scene(self) -> Scene:
        truth = self._simulation.truth
        places = (truth.people, truth.boxes, truth.pictures)
        if self._known is None or self._known[0] != places:
            heights = {picture.name: picture.centre_height_mm for picture in self._simulation.world_file.pictures}
            goals = {
                name: Goal(name, (at.x_mm, at.y_mm), at.heading_deg, heights[name])
                for name, at in truth.pictures.items()
            }
            self._known = (places, Scene(survey(self._simulation), goals))
        return self._known[1]
