"""The outcomes of the other candidates of a decision: the same mission, with another choice forced at that decision.

A mission is repeated from its start with its own seed, which leads to the same decision bit by bit. There a candidate
is forced, and all randomness is reseeded: each seed is one future, and all candidates face the same futures. Afterwards
the profile chooses again. A run of a real robot is repeated in a room made from its map. Method and figures:
docs/evaluation.md.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import cast

from behaviors.executive import Ending, Executive, Report
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.operator import Question
from behaviors.profile_names import ADAPTIVE, THESIS, named_profiles
from behaviors.profiles.profile import MakeProfile
from behaviors.profiles.registry import supervised
from behaviors.recoveries import Choice
from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import did_you_mean
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import read_text, whole_number
from nxtdrive.mission.assembly import MissionRun, open_robot
from nxtdrive.mission.files import check_profile, with_profile
from nxtdrive.recording.run_folder import SUMMARY
from nxtdrive.recording.run_reader import read_run
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.rebuilt_room import rebuilt
from nxtdrive.simulated.robot import GEOMETRIC
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from nxtdrive.transports.address import Address
from nxtdrive.transports.sim import SimTransport
from sim_backend.evaluation import scene, stop_counts
from sim_backend.scenarios.classes import ALL_CLASSES
from sim_backend.simulation import Simulation

from .agents import ALL_NAMES
from .forks import CAN_FORK, Forks
from .runner import Workers

OTHER_RUN = "Choose another run, or CLASS:SEED:PROFILE."
"""The remedy for a run that cannot be repeated."""
Perform = Callable[[Observers, MakeProfile], Report]
"""Performs the mission that was opened, with these observers and this profile."""


@dataclass(frozen=True, slots=True)
class GeneratedMission:
    """A mission of a sweep."""

    kind: str
    seed: int
    profile: str

    @property
    def name(self) -> str:
        """The same however it is written: ``open:100`` also for ``open:100:adaptive``."""
        return f"{self.kind}:{self.seed}" + ("" if self.profile == ADAPTIVE else f":{self.profile}")


@dataclass(frozen=True, slots=True)
class _Run:
    """A run of ``nxtdrive run``.

    Attributes:
        path: Its folder.
    """

    path: Path

    @property
    def name(self) -> str:
        """Its folder."""
        return str(self.path)


@dataclass(frozen=True, slots=True)
class RecordedRun(_Run):
    """A run with a simulated robot.

    Attributes:
        mission: What it did.
        nxt: Address of its brick, as fast as the computer allows.
        camera: Its camera.
        choices: Mission time and name of each choice.
    """

    mission: Mission
    nxt: Address
    camera: str
    choices: tuple[tuple[float, str], ...]


@dataclass(frozen=True, slots=True)
class RebuiltRun(_Run):
    """A run of a real robot, to be repeated in a room made from its map.

    Attributes:
        scenario: Mission and room.
    """

    scenario: Scenario


Source = GeneratedMission | RecordedRun | RebuiltRun


def read_source(name: str) -> Source:
    """Read a mission, named by its run folder or as ``CLASS:SEED[:PROFILE]``.

    Raises:
        ConfigError: It is neither, or cannot be repeated.
    """
    kind, _, rest = name.partition(":")
    seed, _, profile = rest.partition(":")
    if kind in ALL_CLASSES and (number := whole_number(seed)) is not None and not os.path.exists(name):
        if profile in ALL_NAMES and profile not in named_profiles():
            raise ConfigError(
                f"{profile} is an agent of sweeps, not a profile.",
                remedy=f"Write {kind}:{seed} or {kind}:{seed}:{THESIS}.",
            )
        check_profile(profile or ADAPTIVE)
        return GeneratedMission(kind, number, profile or ADAPTIVE)
    if not os.path.isdir(name):
        remedy = did_you_mean(kind, ALL_CLASSES) if rest and kind not in ALL_CLASSES else ""
        raise ConfigError(
            f"{name} is neither a run folder nor CLASS:SEED[:PROFILE].",
            remedy=remedy or "Write clutter:100, for example.",
        )
    return read_recorded(Path(name))


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
        wrong = f"{path} has no complete {SUMMARY}, which says what robot it was, as after a run that was killed."
        raise ConfigError(wrong, remedy=OTHER_RUN) from None
    if past.mission is None:
        raise ConfigError(f"{path} cannot be repeated: its mission is not recorded.", remedy=OTHER_RUN)
    if nxt.scheme != "sim":
        try:
            return RebuiltRun(path, rebuilt(past.records, past.mission))
        except ValueError as error:
            raise ConfigError(f"{path} cannot be repeated in the simulator: {error}.", remedy=OTHER_RUN) from None
    if nxt.target.endswith(".toml") and not os.path.exists(nxt.target):
        raise ConfigError(
            f"{path} was made in the room {nxt.target}, and there is no such file here.",
            remedy="Repeat the command in the folder in which the run was made.",
        )
    choices = [(each.time_s, str(each.data.get("choice"))) for each in past.records if each.kind is RecordKind.CHOICE]
    nxt = replace(nxt, options={**nxt.options, "pace": "fast"})
    return RecordedRun(path, past.mission, nxt, camera, tuple(choices))


@dataclass(frozen=True, slots=True)
class Branch:
    """How a mission continues at a decision.

    Attributes:
        candidate: Number of the candidate, as `behaviors.operator.question` orders them; 0 is the profile's own.
        future: Seed of all randomness afterwards; None to leave it as it was.
    """

    candidate: int = 0
    future: int | None = None


@dataclass(slots=True)
class DecisionPoint:
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
class EpisodeOutcome:
    """The outcome of an episode.

    Attributes:
        limit_s: The mission's time limit.
        targets: All targets that exist.
        decisions: Its decisions, in order.
        reached: Mission time of the first stop that counts for each target, by the ground truth.
    """

    limit_s: float
    targets: tuple[str, ...]
    decisions: list[DecisionPoint] = field(default_factory=list)
    reached: dict[str, float] = field(default_factory=dict)

    def cost_s(self, number: int) -> float:
        """Return the mean seconds from a decision to each target that was still open; the limit where it never came."""
        since_s = self.decisions[number].time_s
        open_now = [target for target in self.targets if self.reached.get(target, self.limit_s) > since_s]
        waits = [min(self.reached.get(target, self.limit_s), self.limit_s) - since_s for target in open_now]
        return max(0.0, sum(waits) / len(waits)) if waits else 0.0


def run_with_branch(
    source: Source,
    decision: int = -1,
    enter: Callable[[], Branch] = Branch,
    tell: Callable[[DecisionPoint], None] = lambda _: None,
) -> EpisodeOutcome:
    """Run a mission in the simulator from its start to its end, with another choice at one decision if wished.

    Args:
        source: The mission.
        decision: Number of the decision, from 0, at which it takes a branch; -1 for none.
        enter: Called there for the branch.
        tell: Called with each decision once it is made.

    Raises:
        ConfigError: The run cannot be repeated.
        KeyboardInterrupt: Ctrl-C, which ends a mission cleanly.
    """
    with (
        _open_recorded(source) if isinstance(source, RecordedRun) else _open_scenario(source) as (mission, sim, perform)
    ):
        pictures = {picture.name for picture in sim.world_file.pictures}
        targets = tuple(target for target in mission.mission.targets if target in pictures)
        outcome, observers = EpisodeOutcome(mission.mission.time_limit_s, targets), Observers()
        observers.add("outcome", partial(_note, outcome, sim, tell))
        ask = partial(_decide, decision, enter, outcome, sim.reseed)
        if perform(observers, supervised(mission, ask)).ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt
        if observers.failures:
            raise RuntimeError(f"observers failed: {dict(observers.failures)}")
    return outcome


def _decide(
    decision: int, enter: Callable[[], Branch], outcome: EpisodeOutcome, reseed: Callable[[str], None], asked: Question
) -> Choice:
    """Choose as the profile does, but for one decision."""
    number, evidence = len(outcome.decisions), asked.evidence
    words = tuple(each.choice.words() for each in asked.candidates)
    outcome.decisions.append(DecisionPoint(evidence.target, evidence.reason.value, words))
    if number != decision:
        return asked.proposed
    branch = enter()
    if branch.future is not None:
        reseed(f"future {branch.future}")
    return asked.candidates[branch.candidate].choice


def _note(
    outcome: EpisodeOutcome, simulation: Simulation, tell: Callable[[DecisionPoint], None], record: Record
) -> None:
    if record.kind is RecordKind.CHOICE:
        made = outcome.decisions[-1]
        made.time_s, made.chose = record.time_s, str(record.data["choice"])
        tell(made)
    claimed = record.kind is RecordKind.TRANSITION and record.data["to"] == "reached"
    if claimed and stop_counts(simulation.truth.pose, scene(simulation), record.target):
        outcome.reached.setdefault(record.target, record.time_s)


@contextmanager
def _open_scenario(source: GeneratedMission | RebuiltRun) -> Iterator[tuple[Mission, Simulation, Perform]]:
    if isinstance(source, GeneratedMission):
        scenario = generate_scenario(source.kind, source.seed)
        scenario = replace(scenario, mission=with_profile(scenario.mission, source.profile))
    else:
        scenario = source.scenario
    with closing(Episode(scenario, GEOMETRIC)) as episode:
        robot = episode.robot

        def perform(observers: Observers, make_profile: MakeProfile) -> Report:
            return Executive(robot.mission, robot.ports, observers, make_profile).run()

        yield robot.mission, episode.simulation, perform


@contextmanager
def _open_recorded(source: RecordedRun) -> Iterator[tuple[Mission, Simulation, Perform]]:
    with open_robot(source.nxt, source.camera) as robot:
        # the run was recorded, and a camera that is watched takes each frame at its time
        robot.watch(lambda _: None)

        def perform(observers: Observers, make_profile: MakeProfile) -> Report:
            return MissionRun(source.mission, robot, observers, make_profile=make_profile).pursue()

        yield source.mission, cast("SimTransport", robot.brick.link.transport).simulation, perform


def branch_costs(source: Source, decision: int, candidates: Sequence[int], futures: int) -> list[list[float]]:
    """Return what these candidates of a decision cost in each future, in seconds: a row for each candidate.

    The episode runs to the decision once and is copied there with its process, where that is possible.
    """
    branches = list(product(candidates, range(futures)))
    if _copies(source):
        with Forks() as forks:
            outcome = run_with_branch(source, decision, lambda: Branch(*branches[forks.each(len(branches))]))
            forks.send_result(outcome.cost_s(decision))
        costs_s = forks.results
    else:
        costs_s = [run_with_branch(source, decision, partial(Branch, *each)).cost_s(decision) for each in branches]
    return [costs_s[first : first + futures] for first in range(0, len(costs_s), futures)]


def _copies(source: Source) -> bool:
    """Return whether copies of this process run the branches of an episode."""
    return CAN_FORK and not isinstance(source, RecordedRun)  # its camera may be a webcam: the thread would be missing


def all_costs(
    source: Source, base: EpisodeOutcome, futures: int, wanted: Iterable[int], workers: Workers
) -> Iterator[tuple[int, list[list[float]]]]:
    """Yield the number of each decision and the costs of its candidates, in order, as they become available.

    Args:
        source: The mission.
        base: What came of it without a branch.
        futures: For each candidate.
        wanted: Numbers of the decisions.
        workers: Run the branches; without copies each candidate by itself, so that one decision keeps all of them busy.
    """
    rows: list[list[float]] = []
    for number, future in workers.run(_calls(source, base, futures, wanted)):
        rows += future.result()
        if len(rows) == len(base.decisions[number].candidates):
            yield number, rows
            rows = []


def _calls(
    source: Source, base: EpisodeOutcome, futures: int, wanted: Iterable[int]
) -> Iterator[tuple[int, Callable[[], list[list[float]]]]]:
    for number in wanted:
        candidates = range(len(base.decisions[number].candidates))
        for part in [candidates] if _copies(source) else [[each] for each in candidates]:
            yield number, partial(branch_costs, source, number, part, futures)
