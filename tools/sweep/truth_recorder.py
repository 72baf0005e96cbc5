"""Record the ground truth of a mission that is needed to evaluate it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from behaviors.executive import Ending
from behaviors.journal import Record, RecordKind
from sim_backend.evaluation import Scene, scene
from sim_backend.simulation import Simulation
from sim_backend.world.truth import TruePose

SAMPLE_MS = 100
"""Sampling period of the ground truth."""
RECORDED_KINDS = (RecordKind.START, RecordKind.TRANSITION, RecordKind.CHOICE, RecordKind.END)
"""Kinds of records that are kept together with the ground truth of their time."""


@dataclass(frozen=True, slots=True)
class TruthSample:
    """The ground truth at one time.

    Attributes:
        time_s: Mission time.
        pose: The robot's pose.
        contacts: How often the robot has touched something so far.
        scene: The positions of all objects; the same `Scene` while nothing moves.
    """

    time_s: float
    pose: TruePose
    contacts: int
    scene: Scene


@dataclass(frozen=True, slots=True)
class RecordWithTruth:
    """A record of the journal, and the ground truth when it was written."""

    record: Record
    sample: TruthSample


@dataclass(frozen=True, slots=True)
class Disturbance:
    """An event that hinders the robot on its way to a target.

    Attributes:
        time_s: Mission time of its beginning.
        target: The target it concerns; an empty string for all targets.
        blocker: Name of the object that blocks the path once it has arrived; empty if the event acts at once.
    """

    time_s: float
    target: str
    blocker: str


@dataclass(frozen=True, slots=True)
class EpisodeTrace:
    """The ground truth of one episode.

    Attributes:
        targets: Names in order.
        samples: Samples of the ground truth, one every `SAMPLE_MS`.
        entries: The records of kinds in `RECORDED_KINDS`, in order.
        disturbances: Events that hindered the robot.
        late_objects: Names of the objects that appeared after the start.
        view_mm: Largest distance at which a print can be recognised in this scenario.
        ending: How the mission ended.
        duration_s: Its duration.
        error: Description of the outage that ended it, or an empty string.
    """

    targets: Sequence[str]
    samples: Sequence[TruthSample]
    entries: Sequence[RecordWithTruth]
    disturbances: Sequence[Disturbance]
    late_objects: frozenset[str]
    view_mm: float
    ending: Ending
    duration_s: float
    error: str = ""


class TruthRecorder:
    """Observe a mission's journal and record the ground truth.

    Args:
        simulation: The simulation of the mission, which begins now.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._start_ms = simulation.now_ms
        self._known: tuple[object, Scene] | None = None
        self.samples: list[TruthSample] = []
        self.entries: list[RecordWithTruth] = []
        self.records: list[Record] = []
        self._watch()

    def __call__(self, record: Record) -> None:
        """Keep a record, and with it the ground truth if its kind is in `RECORDED_KINDS`."""
        self.records.append(record)
        if record.kind in RECORDED_KINDS:
            self.entries.append(RecordWithTruth(record, self._sample()))

    def disturbances(self) -> Iterator[Disturbance]:
        """Yield the disturbances so far."""
        events = {event.name: event for event in self._simulation.world.file.events}
        for time_s, name in self._simulation.truth.events:
            event = events[name]
            if event.picture or event.blocks:
                target, blocker = event.picture or event.blocks or "", "" if event.picture else event.subject
                yield Disturbance(time_s - self._start_ms / 1000, target, blocker)
        spans = self._simulation.webcam.unplugged_ms
        for start_ms in dict(spans):
            # one that begins while the camera is unplugged prolongs that outage
            if not any(before_ms < start_ms <= end_ms for before_ms, end_ms in spans):
                yield Disturbance((start_ms - self._start_ms) / 1000, "", "")

    def _watch(self) -> None:
        self.samples.append(self._sample())
        self._simulation.at(self._simulation.now_ms + SAMPLE_MS, self._watch)

    def _sample(self) -> TruthSample:
        truth = self._simulation.truth
        time_s = (self._simulation.now_ms - self._start_ms) / 1000
        return TruthSample(time_s, truth.pose, truth.contacts, self._scene())

    def _scene(self) -> Scene:
        truth = self._simulation.truth
        places = (truth.people, truth.boxes, truth.pictures)
        if self._known is None or self._known[0] != places:
            self._known = (places, scene(self._simulation))
        return self._known[1]
