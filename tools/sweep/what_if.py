"""The outcomes of the other candidates of a decision: the same mission, with another choice forced at that decision.

A mission is repeated from its start with its own seed, which leads to the same decision bit by bit. There a candidate
is forced, and all randomness is reseeded: each seed is one future, and all candidates face the same futures. Afterwards
the profile chooses again. A run of a real robot is repeated in a room made from its map. Method and figures:
docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Executor, wait
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, cast

from behaviors.executive import Executive
from behaviors.journal import Kind, Record
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.operator import Question
from behaviors.profiles.profile import MakeProfile
from behaviors.profiles.registry import supervised
from behaviors.recoveries import Choice
from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import read_text
from nxtdrive.mission.assembly import MissionRun, open_robot
from nxtdrive.mission.setup import with_profile
from nxtdrive.recording.run_folder import SUMMARY
from nxtdrive.recording.run_reader import read_run
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.rebuilt_room import rebuilt
from nxtdrive.simulated.robot import GEOMETRIC
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from nxtdrive.transports.address import Address
from nxtdrive.transports.sim import SimTransport
from sim_backend.judge import scene, stop_counts

from .runner import CHECK_INTERVAL_S


@dataclass(frozen=True, slots=True)
class GeneratedMission:
    """A mission of a sweep."""

    kind: str
    seed: int
    profile: str


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """A run of ``nxtdrive run`` with a simulated robot.

    Attributes:
        path: Its folder.
        mission: What it did.
        nxt: Address of its brick, as fast as the computer allows.
        camera: Its camera.
        choices: Mission time and name of each choice.
    """

    path: Path
    mission: Mission
    nxt: Address
    camera: str
    choices: tuple[tuple[float, str], ...]


@dataclass(frozen=True, slots=True)
class RebuiltRun:
    """A run of a real robot, to be repeated in a room made from its map.

    Attributes:
        path: Its folder.
        scenario: Mission and room.
    """

    path: Path
    scenario: Scenario


Source = GeneratedMission | RecordedRun | RebuiltRun


def read_recorded(path: Path) -> RecordedRun | RebuiltRun:
    """Read a run.

    Raises:
        ConfigError: It cannot be repeated, or is not a run.
    """
    past = read_run(path)
    try:
        summary = parse_object(read_text(path / SUMMARY, MAX_BYTES))
        nxt, camera = Address.parse(str(summary["nxt"])), str(summary["camera"])
    except (ValueError, KeyError):
        raise ConfigError(f"{path} has no complete {SUMMARY}, which says what robot it was.") from None
    if past.mission is None:
        raise ConfigError(
            f"{path} cannot be played again: its mission is not recorded.",
            remedy="Name another run, or CLASS:SEED:PROFILE.",
        )
    if nxt.scheme != "sim":
        try:
            return RebuiltRun(path, rebuilt(past.records, past.mission))
        except ValueError as error:
            raise ConfigError(f"{path} cannot be played in the simulator: {error}.") from None
    choices = [(each.time_s, str(each.data.get("choice"))) for each in past.records if each.kind is Kind.CHOICE]
    nxt = replace(nxt, options={**nxt.options, "pace": "fast"})
    return RecordedRun(path, past.mission, nxt, camera, tuple(choices))


@dataclass(frozen=True, slots=True)
class Branch:
    """A mission with one candidate forced.

    Attributes:
        source: The mission.
        decision: Number of the decision, from 0; -1 where none is forced.
        candidate: Number of the candidate, as `behaviors.operator.question` orders them; 0 is the profile's own.
        future: Seed of all randomness afterwards; None to leave it as it was.
    """

    source: Source
    decision: int
    candidate: int
    future: int | None


@dataclass(slots=True)
class Decision:
    """A decision that a mission came to.

    Attributes:
        target: The target being pursued.
        reason: Name of the failure.
        candidates: The candidates, in words; the profile proposed the first one.
        time_s: Mission time.
        chose: What was chosen, as the journal names it.
    """

    target: str
    reason: str
    candidates: tuple[str, ...]
    time_s: float = 0.0
    chose: str = ""


@dataclass(slots=True)
class Rollout:
    """How a mission went.

    Attributes:
        decisions: Its decisions, in order.
        reached: Mission time of the first right stop for each target, by the truth.
        targets: All targets that exist.
        limit_s: The mission's time limit.
    """

    limit_s: float
    targets: tuple[str, ...]
    decisions: list[Decision] = field(default_factory=list)
    reached: dict[str, float] = field(default_factory=dict)

    def cost_s(self, number: int) -> float:
        """Return the mean seconds from a decision to each target that was still open; the limit where it never came."""
        since_s = self.decisions[number].time_s
        open_now = [target for target in self.targets if self.reached.get(target, self.limit_s) > since_s]
        waits = [min(self.reached.get(target, self.limit_s), self.limit_s) - since_s for target in open_now]
        return max(0.0, sum(waits) / len(waits)) if waits else 0.0


def play(branch: Branch) -> Rollout:
    """Play a branch to its end.

    Raises:
        ConfigError: The run cannot be repeated.
    """
    source = branch.source
    with _open_recorded(source) if isinstance(source, RecordedRun) else _open_scenario(source) as stage:
        stage.observers.add("rollout", partial(_note, stage.rollout, stage.simulation))
        stage.run(supervised(stage.mission, partial(_decide, branch, stage.rollout, stage.simulation.reseed)))
        if stage.observers.failures:
            raise RuntimeError(f"observers failed: {dict(stage.observers.failures)}")
    return stage.rollout


def _decide(branch: Branch, rollout: Rollout, reseed: Callable[[str], None], asked: Question) -> Choice:
    """Choose as the profile does, but for one decision."""
    number, evidence = len(rollout.decisions), asked.evidence
    words = tuple(each.choice.words() for each in asked.candidates)
    rollout.decisions.append(Decision(evidence.target, evidence.reason.value, words))
    if number != branch.decision:
        return asked.proposed
    if branch.future is not None:
        reseed(f"future {branch.future}")
    return asked.candidates[branch.candidate].choice


def _note(rollout: Rollout, simulation: Any, record: Record) -> None:  # noqa: ANN401 - as the transport gives it
    if record.kind is Kind.CHOICE:
        made = rollout.decisions[-1]
        made.time_s, made.chose = record.time_s, str(record.data["choice"])
    claimed = record.kind is Kind.TRANSITION and record.data["to"] == "reached"
    if claimed and stop_counts(simulation.truth.pose, scene(simulation), record.target):
        rollout.reached.setdefault(record.target, record.time_s)


@dataclass(slots=True)
class _ReadyMission:
    """A mission that is about to begin."""

    mission: Mission
    simulation: Any
    observers: Observers
    run: Callable[[MakeProfile], object]
    rollout: Rollout


def _stage(
    mission: Mission,
    simulation: Any,  # noqa: ANN401 - see above
    observers: Observers,
    run: Callable[[MakeProfile], object],
) -> _ReadyMission:
    """Set a mission up, with the targets that there are or will be."""
    pictures = {picture.name for picture in simulation.world_file.pictures}
    targets = tuple(target for target in mission.mission.targets if target in pictures)
    rollout = Rollout(mission.mission.time_limit_s, targets)
    return _ReadyMission(mission, simulation, observers, run, rollout)


@contextmanager
def _open_scenario(source: GeneratedMission | RebuiltRun) -> Iterator[_ReadyMission]:
    if isinstance(source, GeneratedMission):
        scenario = generate_scenario(source.kind, source.seed)
        scenario = replace(scenario, mission=with_profile(scenario.mission, source.profile))
    else:
        scenario = source.scenario
    mission = scenario.mission
    with closing(Episode(scenario, GEOMETRIC)) as episode:
        robot, observers = episode.robot, Observers()

        def run(make_profile: MakeProfile) -> None:
            Executive(mission, robot.body, robot.eyes, robot.clock, observers, make_profile).run()

        yield _stage(mission, episode.simulation, observers, run)


@contextmanager
def _open_recorded(source: RecordedRun) -> Iterator[_ReadyMission]:
    mission = source.mission
    with open_robot(source.nxt, source.camera) as robot:
        transport, observers = cast("SimTransport", robot.brick.link.transport), Observers()
        # the run was recorded, and a camera that is watched takes each frame when it is due
        robot.watch(lambda _: None)

        def run(make_profile: MakeProfile) -> None:
            MissionRun(mission, robot, observers, make_profile=make_profile).pursue()

        yield _stage(mission, transport.simulation, observers, run)


def branches(source: Source, base: Rollout, futures: int, only: Collection[int] | None = None) -> list[Branch]:
    """Return every candidate of every decision, or of some, in every future."""
    return [
        Branch(source, number, candidate, future)
        for number, made in enumerate(base.decisions)
        if only is None or number in only
        for candidate, future in product(range(len(made.candidates)), range(futures))
    ]


def costs(
    todo: list[Branch], executor: Executor, watch: Callable[[], None] = lambda: None
) -> Iterator[tuple[Branch, float]]:
    """Play branches; yield each with its cost, in order.

    Args:
        todo: The branches.
        executor: Plays them.
        watch: Called every second of waiting; raises if no result can come.
    """
    playing = [executor.submit(_cost_s, branch) for branch in todo]
    try:
        for branch, future in zip(todo, playing, strict=True):
            while not wait([future], CHECK_INTERVAL_S).done:
                watch()
            yield branch, future.result()
    finally:
        for future in playing:
            future.cancel()


def _cost_s(branch: Branch) -> float:
    return play(branch).cost_s(branch.decision)
