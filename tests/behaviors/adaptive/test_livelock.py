"""No livelock: whatever happens, time passes between decisions, nothing is done a third time, and missions end."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise, takewhile
from random import Random

import pytest
from random_ports import RandomPorts, two_targets

from behaviors.adaptive.attempts import SAME_PLACE_MM
from behaviors.adaptive.policy import AdaptivePolicy
from behaviors.adaptive.world_model import WorldModel
from behaviors.chart import MissionChart
from behaviors.events import Event, Fact, Reason
from behaviors.evidence import Detour, Evidence, Viewpoint
from behaviors.executive import Ending, Executive
from behaviors.failures import Blocker
from behaviors.journal import Record, RecordKind
from behaviors.mission import AdaptiveParameters
from behaviors.ports import Point, Ports, Pose
from behaviors.recoveries import CHANGE_TARGET, MOVE_TO, Choice
from behaviors.target_queue import TargetQueue

REPEATS = 2
SEQUENCES = 10_000
POLICY = AdaptivePolicy(AdaptiveParameters(repeats=REPEATS))
PLACES: tuple[Point, ...] = ((0.0, 0.0), (1000.0, 0.0), (0.0, 1000.0))
"""Farther apart than what counts as one place."""
REASONS = (Reason.NEVER_SEEN, Reason.BLOCKED_LONG, Reason.NO_WAY)
RECOVERIES = ("wait", "move_to", "detour", "rescan")
FACTS = {
    "search": (Event.TARGET_SEEN, Event.SEARCH_FAILED, Event.SEARCH_FAILED),
    "arrive": (Event.CONTINUED, Event.ARRIVE_FAILED, Event.ARRIVE_FAILED, Event.OBSTACLE, Event.OBSTACLE_GONE),
    "suspended": (Event.LINK_BACK,),
    **dict.fromkeys(RECOVERIES, (Event.RECOVERY_DONE, Event.RECOVERY_FAILED, Event.TARGET_SEEN, Event.LINK_LOST)),
}
"""What may happen in each state; nothing is ever reached."""


@dataclass
class Decider:
    """Decides as the adaptive profile does, on random evidence; checks what it chooses.

    Attributes:
        world: Keeps what was chosen where.
        random: Draws the evidence.
        targets_left: As in the evidence.
        places: Where the robot may be.
        made: How often each choice was made, by target, kind, place and destination.
        drift_mm: How far from these, each way.
        run: Where, for whom and on what the first of a row of recoveries was chosen, and how many.
        longest_run: The longest run of recoveries at one place after one kind of failure.
    """

    world: WorldModel
    random: Random
    targets_left: int = 2
    places: Sequence[Point] = PLACES
    drift_mm: float = 0.0
    made: Counter[tuple[str, str, Point, Point | None]] = field(default_factory=Counter)
    run: tuple[tuple[str, Reason, Point] | None, int] = (None, 0)
    longest_run: int = 0

    def decide(self, target: str) -> Choice:
        """Choose at a place that is drawn, and remember it."""
        place = self.random.choice(self.places)
        x_mm, y_mm = (each + self.random.uniform(-self.drift_mm, self.drift_mm) for each in place)
        self.world.pose = Pose(x_mm, y_mm)
        reason = self.random.choice(REASONS)
        self.world.attempts.failed(target, 1, reason, self.world.here)
        evidence = self._evidence(target, reason)
        choice = POLICY.select(evidence)
        destination = choice.route[-1] if choice.route else None
        self.world.attempts.chose(target, choice.kind.name, self.world.here, destination)
        self._count(target, reason, choice)
        if choice.kind is not CHANGE_TARGET:
            # a way is another one when it leads elsewhere; a detour always leads past the same thing
            to = destination if choice.kind is MOVE_TO else None
            self.made[target, choice.kind.name, place, to] += 1
        return choice

    def _count(self, target: str, reason: Reason, choice: Choice) -> None:
        """Count recoveries in a row as the sweep's metrics do: near the first of them."""
        first, run = self.run
        if choice.kind is CHANGE_TARGET:
            self.run = None, 0
        elif first and first[:2] == (target, reason) and math.dist(first[2], self.world.here) <= SAME_PLACE_MM:
            self.run = first, run + 1
        else:
            self.run = (target, reason, self.world.here), 1
        self.longest_run = max(self.longest_run, self.run[1])

    def _evidence(self, target: str, reason: Reason) -> Evidence:
        random, world = self.random, self.world
        blocker = Blocker(400.0, random.uniform(0.0, 60.0), random.random() < 0.5, random.random() < 0.7)
        detour = Detour(random.uniform(1.0, 40.0), ((500.0, 500.0),))
        failures, run = world.attempts.failures()
        viewpoints = [
            Viewpoint(random.uniform(1.0, 20.0), 7.0, random.random(), (place,))
            for place in PLACES
            if place != world.here and not world.attempts.tried(target, world.here, place)
        ]
        return Evidence(
            target,
            reason,
            seen_since_search=random.random() < 0.5,
            researches=random.randrange(5),
            targets_left=self.targets_left,
            spent_s=random.uniform(0.0, 60.0),
            blocker=blocker if random.random() < 0.5 else None,
            detour=detour if random.random() < 0.5 else None,
            here=Viewpoint(0.0, 8.0, random.random()) if random.random() < 0.8 else None,
            viewpoints=tuple(viewpoints),
            repeats=world.attempts.repeats(target, world.here),
            failures=failures,
            run=run,
        )


@pytest.mark.slow
@pytest.mark.parametrize("sequences", [SEQUENCES // 10, pytest.param(SEQUENCES, marks=pytest.mark.nightly)])
def test_no_sequence_of_failures_makes_it_do_the_same_a_third_time_at_one_place(sequences):
    mission, decisions = two_targets(["a"]), 0
    for seed in range(sequences):
        random = Random(seed)
        decider = Decider(WorldModel(mission), random, random.randint(1, 2), PLACES[: random.randint(1, 3)])
        for _ in range(random.randint(2, 9)):
            decider.decide("a")
            decisions += 1
        assert not decider.made or max(decider.made.values()) <= REPEATS
        assert decider.longest_run <= REPEATS
    assert decisions > 5 * sequences


@pytest.mark.slow
@pytest.mark.parametrize("drift_mm", [120.0, 240.0])
def test_a_robot_that_drifts_between_its_failures_is_bound_all_the_same(drift_mm):
    mission = two_targets(["a"])
    for seed in range(SEQUENCES // 20):
        random = Random(seed)
        decider = Decider(WorldModel(mission), random, 2, PLACES[:1], drift_mm)
        for _ in range(random.randint(2, 12)):
            decider.decide("a")
        assert decider.longest_run <= REPEATS


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_any_sequence_of_facts_in_which_nothing_is_reached_ends_the_mission(seed):
    """Everything at every place can be tried only so often, so the targets are given up in the end."""
    random, rounds = Random(seed), 3
    queue = TargetQueue(["a", "b"], rounds)
    decider = Decider(WorldModel(two_targets()), random)
    chart = MissionChart(queue, lambda: decider.decide(queue.target))
    chart.report(Fact(Event.START, Reason.MISSION_STARTED))
    at_most = len(queue.targets) * (rounds + len(PLACES) * (3 * REPEATS + len(PLACES)))
    decisions = 0
    while not chart.is_terminated:
        event = random.choice(FACTS[chart.mission_state])
        decisions += event in (Event.SEARCH_FAILED, Event.ARRIVE_FAILED, Event.RECOVERY_FAILED)
        assert decisions <= at_most
        chart.report(Fact(event, Reason.NEVER_SEEN))
    assert not queue.achieved
    assert max(decider.made.values()) <= REPEATS
    assert decider.longest_run <= REPEATS


@dataclass(frozen=True)
class Made:
    """A choice, and where it was made."""

    time_s: float
    target: str
    kind: str
    here: Point
    reason: str

    def repeats(self, other: Made) -> bool:
        """Whether another recovery was chosen at the same place after the same kind of failure."""
        leaves = CHANGE_TARGET.name in (self.kind, other.kind)
        return not leaves and (self.target, self.reason) == (other.target, other.reason) and self.near(other)

    def near(self, other: Made) -> bool:
        """Whether it was made at the same place."""
        return math.dist(self.here, other.here) <= SAME_PLACE_MM


@dataclass
class Witness:
    """Observes the journal and keeps the choices."""

    ports: RandomPorts
    made: list[Made] = field(default_factory=list)

    def __call__(self, record: Record) -> None:
        if record.kind is RecordKind.CHOICE:
            kind, reason = record.data["choice"], record.data["evidence"]["reason"]
            self.made.append(Made(record.time_s, record.target, kind, self.ports.here, reason))

    @property
    def longest_run(self) -> int:
        """How many recoveries were chosen in a row at one place for one target after one kind of failure."""
        runs = [
            1 + sum(1 for _ in takewhile(last.repeats, reversed(self.made[:i])))
            for i, last in enumerate(self.made)
            if last.kind != CHANGE_TARGET.name
        ]
        return max(runs, default=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [*range(10), *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(10, 30))]
)
def test_whatever_happens_to_the_robot_its_mission_ends(seed):
    ports = RandomPorts(seed)
    witness = Witness(ports)
    report = Executive(two_targets(time_limit_s=30.0), Ports(ports, ports, ports), [witness]).run()
    assert report.ending in (Ending.ACHIEVED, Ending.GIVEN_UP, Ending.TIME_UP, Ending.LINK_LOST)
    assert report.duration_s <= 40.0
    assert ports.at_rest
    times_s = [made.time_s for made in witness.made]
    assert times_s == sorted(set(times_s)), "time passes between decisions"
    assert witness.longest_run <= REPEATS
    assert all(other.time_s - one.time_s >= 0.999 for one, other in pairwise(witness.made) if one.near(other))
