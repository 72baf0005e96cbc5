"""An environment that decides: a profile drives, and after each failure an action says what to do."""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from behaviors.events import Reason
from behaviors.executive import Ending, Executive, Report
from behaviors.operator import Ask, OperatorChoice, Question, question_values
from behaviors.pause import Pause
from behaviors.profile_names import ADAPTIVE
from behaviors.profiles.registry import supervised
from behaviors.recoveries import RECOVERIES
from behaviors.stepped_mission import SteppedMission
from nxtdrive.gym.scenario_sampler import TUNING_SEEDS, ScenarioSampler, check_cost, check_vision, episode_info
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.robot import GEOMETRIC

CANDIDATES = 16
"""Largest number of candidates of a decision that an action can name."""
LONGEST_S = 1000.0
"""Longer times are observed as this."""
MAX_OBSERVED_COUNT = 100.0
"""Larger counts are observed as this."""
KINDS, REASONS = tuple(RECOVERIES), tuple(Reason)
NUMBERS = ("seen_since_search", "researches", "round", "targets_left", "spent_s", "failures", "run")
"""Numbers of the evidence, in the order of the observation's ``evidence``; after them come three more of a blocker
(0 or 1 for its presence, its range in metres, whether it hides the target) and the seconds that are left."""
Observation = dict[str, Any]


class _OngoingMission:
    """A mission under way.

    Args:
        episode: Its simulation and robot.
    """

    def __init__(self, episode: Episode) -> None:
        self.episode = episode
        self.stepped = SteppedMission(self._run)

    def _run(self, ask: Ask, pause: Pause) -> Report:
        robot = self.episode.robot
        make = supervised(robot.mission, ask)
        report = Executive(robot.mission, robot.ports, robot.observers, make, pause).run()
        if report.observer_failures:
            raise RuntimeError(f"observers failed: {dict(report.observer_failures)}")
        return report

    def observe(self) -> Observation:
        """Return the open decision as numbers."""
        left_s = self.episode.scenario.mission.mission.time_limit_s - self.episode.time_s
        return observed(self.stepped.question, max(0.0, left_s))

    def info(self) -> dict[str, Any]:
        """Return the open decision in full, and the targets reached by ground truth."""
        question = self.stepped.question
        return episode_info(self.episode) | {"decision": question_values(question) if question else None}

    def end(self) -> None:
        """End the mission and close the simulated brick."""
        self.stepped.end()
        self.episode.close()


class DecisionEnv(gymnasium.Env[Observation, np.int64]):
    """Decides what a robot does after each failure of a mission.

    An action is the number of a candidate; 0 is the profile's proposal, which also replaces a number that no candidate
    has. The reward is 1 for each target at which the robot stops where a stop counts, minus ``cost_per_s`` for each
    second that passed since the first decision. An episode is terminated when the mission ends, and truncated when its
    time is up.

    Args:
        kinds: Classes of scenarios, drawn from for each episode; see docs/evaluation.md.
        seeds: Seeds, drawn from likewise.
        profile: The profile that drives and proposes.
        vision: How targets are seen: ``geometric`` or ``camera``.
        cost_per_s: Reward that each second costs; 0.01 makes a target worth 100 s.

    Raises:
        ConfigError: An argument names nothing that exists.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as its base declares

    def __init__(
        self,
        kinds: Sequence[str] = ("flat",),
        seeds: Sequence[int] = TUNING_SEEDS,
        profile: str = ADAPTIVE,
        vision: str = GEOMETRIC,
        cost_per_s: float = 1.0,
    ) -> None:
        self._scenarios = ScenarioSampler(kinds, seeds, profile)
        self._vision, self._cost_per_s = check_vision(vision), check_cost(cost_per_s)
        self._ongoing: _OngoingMission | None = None
        self._ended = False
        many = MAX_OBSERVED_COUNT
        highest = np.array([1, many, many, many, LONGEST_S, many, many, 1, 10, 1, LONGEST_S], np.float32)
        row = np.array([*([1] * len(KINDS)), LONGEST_S, 1, LONGEST_S], np.float32)
        self.observation_space = spaces.Dict(
            {
                "reason": spaces.Discrete(len(REASONS)),
                "evidence": spaces.Box(np.zeros_like(highest), highest),
                "candidates": spaces.Box(np.zeros((CANDIDATES, len(row)), np.float32), np.tile(row, (CANDIDATES, 1))),
                "action_mask": spaces.MultiBinary(CANDIDATES),
            }
        )
        self.action_space = spaces.Discrete(CANDIDATES)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a mission and run it to its first decision; one that needs none ends with the first step.

        Args:
            seed: Determines all episodes from here on.
            options: ``kind`` and ``seed`` name a scenario instead of drawing one.
        """
        super().reset(seed=seed, options=options)
        self.close()
        self._ended = False
        episode = Episode(self._scenarios.sample(self.np_random, options), self._vision)
        episode.observers.append(episode.note_arrival)
        self._ongoing = ongoing = _OngoingMission(episode)
        ongoing.stepped.step()
        return ongoing.observe(), ongoing.info()

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take a candidate and run the mission to its next decision or its end.

        Raises:
            InvalidAction: The action is not a whole number.
            ResetNeeded: No episode has begun, or it has ended.
        """
        if (ongoing := self._ongoing) is None or self._ended:
            raise gymnasium.error.ResetNeeded("reset() begins an episode.")
        episode, question = ongoing.episode, ongoing.stepped.question
        before_s, reached = episode.time_s, len(episode.reached)
        number = candidate_number(action, len(question.candidates) if question else 0)
        ongoing.stepped.step(number)
        report = ongoing.stepped.report
        self._ended = report is not None
        reward = len(episode.reached) - reached - self._cost_per_s * (episode.time_s - before_s)
        late = report is not None and report.ending is Ending.TIME_UP
        return ongoing.observe(), reward, self._ended and not late, late, ongoing.info() | {"taken": number}

    def close(self) -> None:
        """End the mission under way."""
        if self._ongoing is not None:
            self._ongoing.end()
        self._ongoing = None


def candidate_number(action: np.int64, count: int) -> int:
    """Return the number of the candidate that an action takes; 0 for a number that none of `count` has.

    Raises:
        InvalidAction: It is not a whole number.
    """
    try:
        number = index(action)
    except TypeError:
        raise gymnasium.error.InvalidAction(f"an action is the number of a candidate, not {action!r}.") from None
    return number if 0 <= number < count else 0


def observed(question: Question | None, left_s: float) -> Observation:
    """Return the observation of a decision; without one all is 0 but the remaining time."""
    numbers = np.zeros(len(NUMBERS) + 4, np.float32)
    candidates = np.zeros((CANDIDATES, len(KINDS) + 3), np.float32)
    mask = np.zeros(CANDIDATES, np.int8)
    numbers[-1] = min(left_s, LONGEST_S)
    reason = 0
    if question is not None:
        evidence, blocker = question.evidence, question.evidence.blocker
        reason = REASONS.index(evidence.reason)
        for i, name in enumerate(NUMBERS):
            numbers[i] = min(float(getattr(evidence, name)), LONGEST_S if name == "spent_s" else MAX_OBSERVED_COUNT)
        if blocker is not None:
            numbers[-4:-1] = 1.0, min(max(blocker.range_mm / 1000.0, 0.0), 10.0), blocker.hides
        for i, candidate in enumerate(question.candidates[:CANDIDATES]):
            candidates[i], mask[i] = _row(candidate), 1
    return {"reason": np.int64(reason), "evidence": numbers, "candidates": candidates, "action_mask": mask}


def _row(candidate: OperatorChoice) -> NDArray[np.float32]:
    """Return the kind, the seconds it costs, its chance, and how long it waits."""
    weighed, choice = candidate.weighed, candidate.choice
    kind = [float(name == choice.kind.name) for name in KINDS]
    seconds, chance = (weighed.seconds, weighed.chance) if weighed else (0.0, 0.0)
    return np.array([*kind, min(seconds, LONGEST_S), chance, min(choice.wait_s, LONGEST_S)], np.float32)
