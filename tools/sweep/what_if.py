"""The outcomes of the other candidates of a decision: the same mission, with another choice forced at that decision.

A mission is repeated from its start with its own seed, which leads to the same decision bit by bit. There a candidate
is forced, and all randomness is reseeded: each seed is one future, and all candidates face the same futures. Afterwards
the profile chooses again. A run of a real robot is repeated in a room made from its map. Method and figures:
docs/evaluation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import cast

from behaviors.executive import Ending, Executive, Report
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.operator import Question
from behaviors.profiles.profile import MakeProfile
from behaviors.profiles.registry import supervised
from behaviors.recoveries import Choice
from nxtdrive.mission.assembly import MissionRun, open_robot
from nxtdrive.mission.files import with_profile
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.robot import GEOMETRIC
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.transports.sim import SimTransport
from sim_backend.evaluation import scene, stop_counts
from sim_backend.scenarios.conditions import ViewConditions
from sim_backend.simulation import Simulation

from .forks import CAN_FORK, Forks
from .runner import Workers
from .unseen_targets import UnseenTargets
from .what_if_source import GeneratedMission, RebuiltRun, RecordedRun, Source

Perform = Callable[[Observers, MakeProfile], Report]
"""Performs the mission that was opened, with these observers and this profile."""


@dataclass(frozen=True, slots=True)
class Futures:
    """What the candidates of a decision face.

    Attributes:
        number: Of futures for each candidate.
        redraw_unseen: Whether the targets that have not been in view hang elsewhere in each of them.
    """

    number: int
    redraw_unseen: bool = False


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
    *,
    redraw_unseen: bool = False,
) -> EpisodeOutcome:
    """Run a mission in the simulator from its start to its end, optionally with another choice at one decision.

    Args:
        source: The mission.
        decision: Number of the decision, from 0, at which it takes a branch; -1 for none.
        enter: Called there for the branch.
        tell: Called with each decision once it is made.
        redraw_unseen: Hang the targets that have not been in view elsewhere, as the branch's future has it.

    Raises:
        ConfigError: The run cannot be repeated.
        KeyboardInterrupt: Ctrl-C, which ends a mission cleanly.
    """
    with (
        _open_recorded(source) if isinstance(source, RecordedRun) else _open_scenario(source) as (mission, sim, perform)
    ):
        pictures = {picture.name for picture in sim.world.file.pictures}
        targets = tuple(target for target in mission.mission.targets if target in pictures)
        outcome, observers = EpisodeOutcome(mission.mission.time_limit_s, targets), Observers()
        observers.add("outcome", partial(_note, outcome, sim, tell))
        unseen = UnseenTargets(sim, targets, _view_mm(source)) if redraw_unseen else None

        def begin(future: int) -> None:
            sim.reseed(f"future {future}")
            if unseen:
                unseen.hang_elsewhere(future)

        ask = partial(_decide, decision, enter, outcome, begin)
        if perform(observers, supervised(mission, ask)).ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt
        if observers.failures:
            raise RuntimeError(f"observers failed: {dict(observers.failures)}")
    return outcome


def _decide(
    decision: int, enter: Callable[[], Branch], outcome: EpisodeOutcome, begin: Callable[[int], None], asked: Question
) -> Choice:
    """Choose as the profile does, but for one decision."""
    number, evidence = len(outcome.decisions), asked.evidence
    words = tuple(each.choice.words() for each in asked.candidates)
    outcome.decisions.append(DecisionPoint(evidence.target, evidence.reason.value, words))
    if number != decision:
        return asked.proposed
    branch = enter()
    if branch.future is not None:
        begin(branch.future)
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


def _view_mm(source: Source) -> float:
    """Return the largest distance at which a target can be recognised."""
    if not isinstance(source, GeneratedMission):
        return ViewConditions().range_mm
    return generate_scenario(source.kind, source.seed).conditions.view.range_mm


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


def branch_costs(source: Source, decision: int, candidates: Sequence[int], futures: Futures) -> list[list[float]]:
    """Return what these candidates of a decision cost in each future, in seconds: a row for each candidate.

    The episode runs to the decision once and is copied there with its process, where that is possible.
    """
    branches = list(product(candidates, range(futures.number)))
    outcome = partial(run_with_branch, source, decision, redraw_unseen=futures.redraw_unseen)
    if _copies(source):
        with Forks() as forks:
            forks.send_result(outcome(lambda: Branch(*branches[forks.each(len(branches))])).cost_s(decision))
        costs_s = forks.results
    else:
        costs_s = [outcome(partial(Branch, *each)).cost_s(decision) for each in branches]
    return [costs_s[first : first + futures.number] for first in range(0, len(costs_s), futures.number)]


def _copies(source: Source) -> bool:
    """Return whether copies of this process run the branches of an episode."""
    return CAN_FORK and not isinstance(source, RecordedRun)  # its camera may be a webcam: the thread would be missing


def all_costs(
    source: Source, base: EpisodeOutcome, futures: Futures, wanted: Iterable[int], workers: Workers
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
    source: Source, base: EpisodeOutcome, futures: Futures, wanted: Iterable[int]
) -> Iterator[tuple[int, Callable[[], list[list[float]]]]]:
    for number in wanted:
        candidates = range(len(base.decisions[number].candidates))
        for part in [candidates] if _copies(source) else [[each] for each in candidates]:
            yield number, partial(branch_costs, source, number, part, futures)
