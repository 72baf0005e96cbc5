"""Measure the CPU time of behaviors: a fact reported to the chart, a frame, a decision, whole missions.

CPU time depends little on the machine's other load. Frames are timed while the robot scans at the start of the
sweep's missions, decisions throughout the missions, when maps and beliefs are largest. The results are in
docs/adaptive.md, "What it costs".
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from functools import partial
from itertools import product

from behaviors.adaptive.perception import Perception
from behaviors.adaptive.scan import ScanSkill
from behaviors.adaptive.world_model import WorldModel
from behaviors.chart import MissionChart
from behaviors.events import Event, Fact, Reason
from behaviors.evidence import Evidence
from behaviors.executive import Executive
from behaviors.failures import Failure
from behaviors.mission import Mission
from behaviors.ports import FloorRay, Glimpse, Pose, Sighting
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.recoveries import WAIT, Choice
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.robot import GEOMETRIC
from nxtdrive.simulated.scenario import generate_scenario
from sim_backend.scenarios.classes import CLASSES

from ..sweep.task import Task, evaluate
from .bench import REPEATS, Figure, at_least, at_most

# Windows counts CPU time in steps of 15.6 ms, too coarse for single decisions
cpu_s = time.perf_counter if sys.platform == "win32" else time.process_time

TURNS = 500
"""How often the facts in `FACTS` are reported to the chart in each repeat."""
HARD = ("far", "clutter", "block_transient", "block_permanent", "absent", "moved", "narrow_door")
"""Classes with many decisions."""
SEEDS = range(100, 105)
"""Seeds of their missions, which have about two hundred decisions."""
FACT_US, DECISION_MS = 500.0, 50.0
EASY_PER_MIN, BIG_PER_MIN = 100.0, 30.0
"""Goals; the last two for missions of the easy suite, and in flats of eight to twelve rooms."""
SHARE = 0.99
"""Share of the decisions that must meet the goal."""


def measure_behaviors(
    *,
    turns: int = TURNS,
    hard: Sequence[str] = HARD,
    seeds: Sequence[int] = SEEDS,
    easy: Sequence[str] = tuple(CLASSES),
    big: Sequence[str] = ("big",),
) -> Iterable[Figure]:
    """Yield every figure as it is measured; takes about three minutes.

    Args:
        turns: How often the facts in `FACTS` are reported to the chart in each repeat.
        hard: Classes of the missions in which frames and decisions are timed.
        seeds: Their seeds.
        easy: Classes of the missions whose rate is measured, one mission each.
        big: The same with larger rooms.
    """
    yield from _chart_figures(turns)
    yield from _model_figures(list(product(hard, seeds)))
    for agent in "thesis", "adaptive":
        yield _pace(agent, easy, EASY_PER_MIN)
        yield _pace(agent, big, BIG_PER_MIN)


FACTS: dict[str, tuple[Event, ...]] = {
    "to another state": (Event.TARGET_SEEN, Event.ARRIVE_FAILED, Event.RECOVERY_DONE),
    "of another region": (Event.OBSTACLE, Event.OBSTACLE_GONE),
    "ignored": (Event.ARRIVED,),
}
"""Facts that lead a searching robot back to its initial state."""


def searching_chart() -> MissionChart:
    """Return the chart of a robot that searches."""
    chart = MissionChart(TargetQueue(["lena", "rilakkuma"]), lambda: Choice(WAIT, "measured"))
    chart.report(Fact(Event.START, Reason.MISSION_STARTED))
    return chart


def _chart_figures(turns: int) -> Iterable[Figure]:
    """Measure a fact reported to the chart, next to the cheapest possible state machine."""
    yield Figure("fact to a bare dict of transitions, CPU", _dict_dispatch_us(turns * 100), "µs")
    for name, events in FACTS.items():
        took_us = _each_us(searching_chart().report, events, turns)
        yield at_most(f"fact to the chart, {name}, CPU", took_us, "µs", FACT_US)


def _dict_dispatch_us(turns: int) -> float:
    """Measure a state machine that is only a dict."""
    table = {("search", Event.TARGET_SEEN): "arrive", ("arrive", Event.ARRIVE_FAILED): "search"}
    state = "search"

    def report(fact: Fact) -> None:
        nonlocal state
        state = table.get((state, fact.event), state)

    return _each_us(report, (Event.TARGET_SEEN, Event.ARRIVE_FAILED), turns)


def _each_us(report: Callable[[Fact], None], events: Sequence[Event], turns: int) -> float:
    """Return the CPU time of one report."""
    facts = [Fact(event, Reason.SIGHTED) for event in events]
    rounds = []
    for _ in range(REPEATS):
        begun_s = cpu_s()
        for _ in range(turns):
            for fact in facts:
                report(fact)
        rounds.append((cpu_s() - begun_s) / (turns * len(facts)) * 1e6)
    return statistics.median(rounds)


class TimedWorldModel(WorldModel):
    """A world model that measures the cost of each update with a frame.

    Args:
        mission: The mission with its targets.

    Attributes:
        times_s: CPU time of each frame, with its echo and its free floor.
    """

    def __init__(self, mission: Mission) -> None:
        super().__init__(mission)
        self.times_s: list[float] = []

    def perceive(
        self,
        now_s: float,
        pose: Pose,
        range_mm: float | None,
        looked_for: Sequence[str],
        glimpse: Glimpse,
        *,
        sonar_works: bool = True,
    ) -> Mapping[str, Sighting]:
        """Update with a frame and an echo."""
        begun_s = cpu_s()
        accepted = super().perceive(now_s, pose, range_mm, looked_for, glimpse, sonar_works=sonar_works)
        self.times_s.append(cpu_s() - begun_s)
        return accepted

    def see_floor(self, time_s: float, rays: Sequence[FloorRay], range_mm: float | None) -> None:
        """Update with the free floor in the frame."""
        begun_s = cpu_s()
        super().see_floor(time_s, rays, range_mm)
        self.times_s[-1] += cpu_s() - begun_s


class TimedProfile(AdaptiveProfile):
    """The adaptive profile, which measures the cost of each decision: learning, evidence and choice.

    Args:
        times_s: Receives the CPU times.
        context: What skills work with.
        mission: The mission.
        queue: Its current target is pursued.
    """

    def __init__(self, times_s: list[float], context: SkillContext, mission: Mission, queue: TargetQueue) -> None:
        super().__init__(context, mission, queue)
        self._times_s = times_s
        self._gathered_s = 0.0

    def learn(self, failure: Failure) -> None:
        """Update the world model."""
        begun_s = cpu_s()
        super().learn(failure)
        self._gathered_s = cpu_s() - begun_s

    def evidence(self, basis: Evidence) -> Evidence:
        """Add the candidates."""
        begun_s = cpu_s()
        evidence = super().evidence(basis)
        self._gathered_s += cpu_s() - begun_s
        return evidence

    def select(self, evidence: Evidence) -> Choice:
        """Choose, which completes the decision."""
        begun_s = cpu_s()
        choice = super().select(evidence)
        self._times_s.append(self._gathered_s + cpu_s() - begun_s)
        return choice


def _discard(*_: object, **__: object) -> None:
    """Discard a record; no journal is kept."""


def frame_times_s(kind: str, seed: int) -> list[float]:
    """Return the CPU time of each frame of the first scan in a mission of the sweep."""
    with closing(Episode(generate_scenario(kind, seed), GEOMETRIC)) as episode:
        robot = episode.robot
        mission, world = robot.mission, TimedWorldModel(robot.mission)
        context = SkillContext(*robot.ports, mission.thesis, _discard, _discard)
        ScanSkill(Perception(context, mission.adaptive, world, TargetQueue(mission.mission.targets))).call()
    return world.times_s


def decision_times_s(kind: str, seed: int) -> list[float]:
    """Return the CPU time of each decision of the adaptive profile in a mission of the sweep."""
    times_s: list[float] = []
    with closing(Episode(generate_scenario(kind, seed), GEOMETRIC)) as episode:
        robot = episode.robot
        Executive(robot.mission, robot.ports, [], partial(TimedProfile, times_s)).run()
    return times_s


def _model_figures(missions: Sequence[tuple[str, int]]) -> Iterable[Figure]:
    """Measure the cost of frames and decisions in these missions, (class, seed)."""
    frames_s = [time_s for kind, seed in missions for time_s in frame_times_s(kind, seed)]
    middle_ms, high_ms = spread_ms(frames_s)
    yield Figure(f"adaptive: frame to world model, median of {len(frames_s)}, CPU", middle_ms, "ms")
    yield Figure("adaptive: frame to world model, 99 %, CPU", high_ms, "ms")
    decisions_s = [time_s for kind, seed in missions for time_s in decision_times_s(kind, seed)]
    middle_ms, high_ms = spread_ms(decisions_s)
    yield Figure(f"adaptive: decision, median of {len(decisions_s)}, CPU", middle_ms, "ms")
    yield at_most("adaptive: decision, 99 %, CPU", high_ms, "ms", DECISION_MS)


def spread_ms(times_s: Sequence[float]) -> tuple[float, float]:
    """Return the median and the 99th percentile, in milliseconds; NaN when nothing was measured."""
    if not times_s:
        return math.nan, math.nan
    ordered = sorted(times_s)
    return statistics.median(ordered) * 1000, ordered[math.ceil(SHARE * len(ordered)) - 1] * 1000


def _pace(agent: str, kinds: Sequence[str], goal_per_min: float) -> Figure:
    """Measure how many missions one core runs in a minute, evaluation included."""
    begun_s = cpu_s()
    for index, kind in enumerate(kinds):
        evaluate(Task(index, kind, SEEDS[0], agent, GEOMETRIC))
    pace_per_min = len(kinds) * 60.0 / (cpu_s() - begun_s)
    name = f"missions a minute of CPU, {agent}, {kinds[0] if len(kinds) == 1 else f'{len(kinds)} classes'}"
    return at_least(name, pace_per_min, "1/min", goal_per_min)
