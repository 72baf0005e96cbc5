"""The task of running one mission of a sweep and evaluating it.

An *episode* is one mission in one simulated scenario, from its start to its end, as in Gymnasium and LeRobot.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field, fields, is_dataclass, replace
from hashlib import sha256
from typing import Any

from behaviors.executive import Ending
from behaviors.mission import described_by
from behaviors.mission.robot import RobotFile
from behaviors.profiles.registry import raised_by_profile
from nxtdrive.recording.predictions import Prediction, predictions
from nxtdrive.signals import Terminated
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from sim_backend.world.world_file import WorldFile

from .agents import drive, equipped
from .causes import evaluate_choices, longest_run, recognition_s, soonest_s
from .chart_coverage import taken
from .metrics import evaluate_target
from .mission_result import USUAL_TARGETS, Key, MissionResult
from .truth_recorder import EpisodeTrace, TruthRecorder

UNCHANGED = RobotFile()
DIGEST_DIGITS = 12


@dataclass(frozen=True, slots=True, order=True)
class Task:
    """One mission of a sweep.

    Attributes:
        index: Its place in the sweep.
        kind: Class of the scenario.
        seed: Seed of the scenario.
        agent: Name of the agent that drives.
        vision: How targets are seen: ``geometric`` or ``camera``.
        robot: Description of the robot for the missions, where they have none themselves.
    """

    index: int
    kind: str
    seed: int
    agent: str
    vision: str
    robot: RobotFile = field(default=UNCHANGED, compare=False)

    @property
    def described(self) -> str:
        """A digest of the description of the robot; empty without one."""
        # a value that equals the default counts as measured
        values = self.robot.model_dump_json(exclude_unset=True)
        return "" if values == "{}" else sha256(values.encode()).hexdigest()[:DIGEST_DIGITS]

    @property
    def key(self) -> Key:
        """Identify the mission across sweeps."""
        return self.kind, self.seed, self.agent, self.vision, self.described


def run_episode(scenario: Scenario, agent: str, vision: str) -> tuple[EpisodeTrace, TruthRecorder]:
    """Run an episode and record its ground truth.

    Returns:
        The trace to evaluate, and the recorder, which has the journal.

    Raises:
        KeyboardInterrupt: Ctrl-C, even if the agent ended the mission cleanly.
        Exception: Any error that breaks the mission or its recorder, a livelock for instance.
    """
    scenario = replace(scenario, mission=equipped(agent, scenario.mission))
    with closing(Episode(scenario, vision)) as episode:
        recorder = TruthRecorder(episode.simulation)
        episode.observers.append(recorder)
        report = drive(agent, episode.robot, episode.simulation)
        if report.ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt  # Ctrl-C stops the sweep, not only this mission
        if report.observer_failures:
            raise RuntimeError(f"observers failed: {dict(report.observer_failures)}")
        # closing the brick takes time, and the robot may still roll
        ended_s = report.duration_s
        samples = [sample for sample in recorder.samples if sample.time_s <= ended_s]
    trace = EpisodeTrace(
        targets=list(scenario.mission.mission.targets),
        samples=samples,
        entries=recorder.entries,
        disturbances=[each for each in recorder.disturbances() if each.time_s <= ended_s],
        late_objects=late_objects(scenario.world),
        view_mm=scenario.conditions.view.range_mm,
        ending=report.ending,
        duration_s=ended_s,
        error=report.error,
    )
    return trace, recorder


def late_objects(world: WorldFile) -> frozenset[str]:
    """Return the names of the people and boxes that are absent at the start."""
    return frozenset([*(person.name for person in world.people), *(box.name for box in world.boxes if not box.present)])


def scenario_of(task: Task) -> Scenario:
    """Generate the scenario of a task, whose mission describes the robot as the task does."""
    scenario = generate_scenario(task.kind, task.seed)
    return replace(scenario, mission=described_by(scenario.mission, task.robot))


def evaluate(task: Task) -> MissionResult:
    """Run a task and return its result, even if the mission breaks."""
    try:
        scenario = scenario_of(task)
        trace, recorder = run_episode(scenario, task.agent, task.vision)
        return result_of(task, trace, predictions(recorder.records, task.agent, scenario.mission))
    except Terminated:
        raise
    except (Exception, SystemExit) as error:  # noqa: BLE001 - one mission must not end a sweep; its result says why
        return failed(task, raised_by_profile(error, task.agent) or error)


def failed(task: Task, error: BaseException) -> MissionResult:
    """Return the result of a task that broke: no target reached, and the error."""
    return MissionResult(
        **_head(task),
        success=False,
        sum_reward=0.0,
        max_reward=0.0,
        done=False,
        ending=Ending.BROKEN,
        error=f"{type(error).__name__}: {error}",
        unreached=_existing_targets(task),
        targets=[],
    )


def _existing_targets(task: Task) -> int:
    """Return how many of a mission's targets exist; the usual number if its scenario cannot be generated."""
    try:
        scenario = generate_scenario(task.kind, task.seed)
    except Exception:  # noqa: BLE001 - that may be what broke the mission, and is reported
        return USUAL_TARGETS
    pictures = {picture.name for picture in scenario.world.pictures}
    return sum(target in pictures for target in scenario.mission.mission.targets)


def result_of(task: Task, trace: EpisodeTrace, chances: Sequence[Prediction] = ()) -> MissionResult:
    """Return the result of a mission from its trace.

    Numbers are rounded to a thousandth: further digits differ between machines.
    """
    targets = [evaluate_target(trace, target) for target in trace.targets]
    rewards = [float(target.success) for target in targets]
    return MissionResult(
        **_head(task),
        success=all(target.success for target in targets if target.reachable),
        sum_reward=sum(rewards),
        max_reward=max(rewards),
        done=True,
        ending=trace.ending,
        error=trace.error,
        duration_s=_rounded(trace.duration_s),
        contacts=trace.samples[-1].contacts,
        targets=_rounded(targets),
        recognition_s=_rounded(recognition_s(trace)),
        choices=_rounded(evaluate_choices(trace)),
        transitions=taken(entry.record for entry in trace.entries),
        longest_run=longest_run(trace),
        soonest_s=_rounded(soonest_s(trace)),
        chances=_rounded(list(chances)),
    )


def _rounded(value: Any) -> Any:  # noqa: ANN401 - any plain value, or a dataclass of them
    if isinstance(value, float):
        return round(value, 3)
    if isinstance(value, list):
        return [_rounded(each) for each in value]
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: _rounded(getattr(value, each.name)) for each in fields(value)})
    return value


def _head(task: Task) -> dict[str, Any]:
    head = {
        "episode_index": task.index,
        "kind": task.kind,
        "seed": task.seed,
        "agent": task.agent,
        "vision": task.vision,
    }
    return {**head, "robot": task.described} if task.described else head
