"""What every other candidate of a decision would have led to: the same mission, forced from that decision on.

A mission is repeated from its start with its own seed, which leads to the same decision bit by bit. There a candidate
is forced, and all chance is seeded anew: each seed is one future, and all candidates face the same futures. Afterwards
the profile chooses again. Method and figures: docs/evaluation.md.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from behaviors.evidence import Evidence
from behaviors.executive import Executive
from behaviors.journal import Kind, Record
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.operator import question
from behaviors.profiles.registry import find_profile, make_policy
from behaviors.recoveries import Choice, RecoveryPolicy
from firmware_protocol.errors import ConfigError
from nxtdrive.mission.assembly import MissionRun, open_robot
from nxtdrive.mission.setup import with_profile
from nxtdrive.recording.run_folder import SUMMARY
from nxtdrive.recording.run_reader import read_run
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.robot import GEOMETRIC
from nxtdrive.simulated.scenario import Scenario, draw_scenario
from nxtdrive.transports.record import recorded
from nxtdrive.transports.sim import SimTransport
from sim_backend.judge import scene, stop_counts


@dataclass(frozen=True, slots=True)
class Drawn:
    """A mission of a sweep."""

    kind: str
    seed: int
    profile: str


@dataclass(frozen=True, slots=True)
class Folder:
    """A run of ``nxtdrive run`` with a simulated robot."""

    path: str


@dataclass(frozen=True, slots=True)
class Branch:
    """A mission with one candidate forced.

    Attributes:
        source: The mission.
        decision: Number of the decision, from 0.
        candidate: Number of the candidate, as `behaviors.operator.question` orders them; 0 is the profile's own.
        future: Seeds what chance decides afterwards; None to leave it as it was.
    """

    source: Drawn | Folder
    decision: int
    candidate: int
    future: int | None


@dataclass(slots=True)
class Made:
    """A decision that a mission came to.

    Attributes:
        time_s: Mission time.
        target: What was pursued.
        reason: Name of the failure.
        candidates: What could be done, in words; the first one was chosen.
    """

    time_s: float
    target: str
    reason: str
    candidates: tuple[str, ...]


@dataclass(slots=True)
class Course:
    """How a mission went.

    Attributes:
        decisions: Its decisions, in order.
        choices: What was chosen at each, as the journal names it.
        reached: Mission time of the first right stop for each target, by the truth.
        targets: All targets that exist.
        limit_s: The mission's time limit.
    """

    limit_s: float
    targets: tuple[str, ...]
    decisions: list[Made] = field(default_factory=list)
    choices: list[tuple[float, str]] = field(default_factory=list)
    reached: dict[str, float] = field(default_factory=dict)

    def cost_s(self, number: int) -> float:
        """Return the mean seconds from a decision to each target that was still open; the limit where it never came."""
        since_s = self.decisions[number].time_s
        open_now = [target for target in self.targets if self.reached.get(target, self.limit_s) > since_s]
        waits = [min(self.reached.get(target, self.limit_s), self.limit_s) - since_s for target in open_now]
        return max(0.0, sum(waits) / len(waits)) if waits else 0.0


class _Forced:
    """A policy that chooses as another one does, but for one decision."""

    def __init__(self, policy: RecoveryPolicy, branch: Branch, course: Course, reseed: Callable[[str], None]) -> None:
        self._policy, self._branch, self._course, self._reseed = policy, branch, course, reseed

    def select(self, evidence: Evidence) -> Choice:
        """Choose; the decision is noted."""
        asked, number = question(self._policy, evidence), len(self._course.decisions)
        words = tuple(each.choice.words() for each in asked.candidates)
        self._course.decisions.append(Made(0.0, evidence.target, evidence.reason.value, words))
        if number != self._branch.decision:
            return asked.proposed
        if self._branch.future is not None:
            self._reseed(f"future {self._branch.future}")
        return asked.candidates[self._branch.candidate].choice


def play(branch: Branch) -> Course:
    """Play a branch to its end.

    Raises:
        ConfigError: The run cannot be repeated.
    """
    source = branch.source
    with _open_drawn(source) if isinstance(source, Drawn) else _open_folder(source) as stage:
        course, policy = stage.course, make_policy(stage.mission.mission.profile, stage.mission)
        forced = _Forced(policy, branch, course, stage.simulation.reseed)
        stage.observers.add("course", partial(_note, course, stage.simulation))
        stage.run(partial(find_profile(stage.mission.mission.profile), policy=forced))
        if stage.observers.failures:
            raise RuntimeError(f"observers failed: {dict(stage.observers.failures)}")
    return course


def _note(course: Course, simulation: Any, record: Record) -> None:  # noqa: ANN401 - as the transport gives it
    if record.kind is Kind.CHOICE:
        course.choices.append((record.time_s, str(record.data["choice"])))
        course.decisions[-1].time_s = record.time_s
    claimed = record.kind is Kind.TRANSITION and record.data["to"] == "reached"
    if claimed and stop_counts(simulation.truth.pose, scene(simulation), record.target):
        course.reached.setdefault(record.target, record.time_s)


@dataclass(slots=True)
class _Stage:
    """A mission that is about to begin."""

    mission: Mission
    simulation: Any
    observers: Observers
    run: Callable[[Any], object]
    course: Course


def _stage(
    mission: Mission,
    simulation: Any,  # noqa: ANN401 - see above
    observers: Observers,
    run: Callable[[Any], object],
) -> _Stage:
    """Set a mission up, with the targets that there are or will be."""
    pictures = {picture.name for picture in simulation.world_file.pictures}
    targets = tuple(target for target in mission.mission.targets if target in pictures)
    course = Course(mission.mission.time_limit_s, targets)
    return _Stage(mission, simulation, observers, run, course)


@contextmanager
def _open_drawn(source: Drawn) -> Iterator[_Stage]:
    drawn = draw_scenario(source.kind, source.seed)
    mission = with_profile(drawn.mission, source.profile)
    scenario = Scenario(drawn.kind, drawn.seed, drawn.world, mission, drawn.faults, drawn.latency_ms, drawn.sight)
    episode, observers = Episode(scenario, GEOMETRIC), Observers()
    robot = episode.robot

    def run(make_profile: Any) -> None:  # noqa: ANN401 - a profile's class with a policy
        Executive(mission, robot.body, robot.eyes, robot.clock, observers, make_profile).run()

    try:
        yield _stage(mission, episode.simulation, observers, run)
    finally:
        episode.close()


@contextmanager
def _open_folder(source: Folder) -> Iterator[_Stage]:
    path = Path(source.path)
    past = read_run(path)
    try:
        summary = json.loads((path / SUMMARY).read_text(encoding="utf-8"))
        nxt, camera = str(summary["nxt"]), str(summary["camera"])
    except (OSError, ValueError, KeyError, TypeError):
        raise ConfigError(f"{path} has no complete {SUMMARY}, which says what robot it was.") from None
    if past.mission is None or not nxt.startswith("sim://"):
        raise ConfigError(
            f"{path} cannot be repeated: its robot was not simulated, or its mission is not recorded.",
            remedy="Name a run of a simulated robot, or CLASS:SEED:PROFILE.",
        )
    with open_robot(nxt.replace("pace=realtime", "pace=fast"), camera) as robot:
        transport, observers = recorded(robot.brick.link.transport), Observers()
        if not isinstance(transport, SimTransport):
            raise ConfigError(f"{path} cannot be repeated: its robot was not simulated.")
        mission = past.mission
        # the run was recorded, and a camera that is watched takes each frame when it is due
        robot.watch(lambda _: None)

        def run(make_profile: Any) -> None:  # noqa: ANN401 - a profile's class with a policy
            MissionRun(mission, robot, observers, make_profile=make_profile).pursue()

        yield _stage(mission, transport.simulation, observers, run)


def branches(source: Drawn | Folder, base: Course, futures: int, only: int | None = None) -> list[Branch]:
    """Return every candidate of every decision, or of one, in every future."""
    return [
        Branch(source, number, candidate, future)
        for number, made in enumerate(base.decisions)
        if only is None or number == only
        for candidate, future in product(range(len(made.candidates)), range(futures))
    ]


def costs(todo: list[Branch], executor: Executor) -> Iterator[tuple[Branch, float]]:
    """Play branches; yield each with what it cost, in order."""
    return zip(todo, executor.map(_cost_s, todo), strict=True)


def _cost_s(branch: Branch) -> float:
    return play(branch).cost_s(branch.decision)
