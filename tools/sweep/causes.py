"""Evaluate recoveries: how soon a failure was noticed, and whether the choice fitted its cause.

Definitions: docs/evaluation.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise

import numpy as np

from behaviors.journal import RecordKind
from behaviors.recoveries import CHANGE_TARGET, RECOVERIES
from sim_backend.scenarios.floor_plan import FloorPlan, Goal
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM
from sim_backend.world.sensing import VIEW_ANGLE_DEG

from .metrics import LIMITS, spans
from .truth_recorder import Disturbance, EpisodeTrace, RecordWithTruth, TruthSample

SAME_PLACE_MM = 250.0
"""Choices no farther apart than this count as made in the same place."""
MOVED_DURING_PURSUIT_S = 1.0
"""A picture that moved at most this long ago was being pursued when it moved."""


class FailureCause(StrEnum):
    """The true cause of a failed attempt."""

    BLOCKED_SHORT = "blocked_short"
    BLOCKED_LONG = "blocked_long"
    ELSEWHERE = "elsewhere"
    MISSED = "missed"


FITTING = {FailureCause(recovery.fits): recovery.name for recovery in RECOVERIES.values() if recovery.fits}
"""The choice that fits each cause."""


@dataclass(frozen=True, slots=True)
class ChoiceEvaluation:
    """A choice, evaluated by the ground truth.

    Attributes:
        cause: Why the attempt failed.
        choice: What was chosen.
        regret_s: Its cost beyond the best choice, seconds; None where that is not defined.
    """

    cause: FailureCause
    choice: str
    regret_s: float | None

    @property
    def fits(self) -> bool:
        """Whether the choice fits the cause."""
        return FITTING[self.cause] == self.choice


def evaluate_choices(trace: EpisodeTrace) -> list[ChoiceEvaluation]:
    """Evaluate every choice of a mission, except those that gave a target up and those for an absent target."""
    return [
        evaluation
        for i, entry in enumerate(trace.entries)
        if entry.record.kind is RecordKind.CHOICE and entry.record.data["choice"] != CHANGE_TARGET.name
        if (evaluation := _evaluated(trace, i, entry)) is not None
    ]


def recognition_s(trace: EpisodeTrace) -> list[float]:
    """Return the seconds from each disturbance to the next choice for the target it concerns.

    The loss of the camera leads to no choice: it counts as noticed when the mission is suspended.
    """
    onsets = sorted(
        (onset_s, one.target) for one in trace.disturbances if (onset_s := _onset_s(trace, one)) is not None
    )
    delays = []
    for onset_s, target in onsets:
        noticed = (entry for entry in _choices(trace, onset_s) if entry.record.target == target)
        after = next(noticed if target else _suspensions(trace, onset_s), None)
        newer = [other_s for other_s, other in onsets if other_s > onset_s and other == target]
        if after and not (newer and newer[0] < after.sample.time_s):
            delays.append(after.sample.time_s - onset_s)
    return delays


def longest_run(trace: EpisodeTrace) -> int:
    """Return the length of the longest run of recoveries for one target at one place after the same kind of failure.

    Every choice counts, except leaving the target, which ends a run.
    """
    longest = run = 0
    first: RecordWithTruth | None = None
    for entry in _choices(trace, -math.inf):
        if entry.record.data["choice"] == CHANGE_TARGET.name:
            run, first = 0, None
            continue
        same = first is not None and _failed_as(entry) == _failed_as(first) and _at_one_place(entry, first)
        run, first = (run + 1, first) if same else (1, entry)
        longest = max(longest, run)
    return longest


def soonest_s(trace: EpisodeTrace) -> float | None:
    """Return the shortest time from a decision to the next one at the same place; None without such a pair."""
    pairs = [(one, other) for one, other in pairwise(_choices(trace, -math.inf)) if _at_one_place(one, other)]
    return min((other.record.time_s - one.record.time_s for one, other in pairs), default=None)


def _failed_as(entry: RecordWithTruth) -> tuple[str, str]:
    evidence = entry.record.data.get("evidence")
    return entry.record.target, str(evidence["reason"]) if isinstance(evidence, dict) else ""


def _at_one_place(one: RecordWithTruth, other: RecordWithTruth) -> bool:
    return math.dist(one.sample.pose[:2], other.sample.pose[:2]) <= SAME_PLACE_MM


def _choices(trace: EpisodeTrace, since_s: float) -> Iterator[RecordWithTruth]:
    return (
        entry for entry in trace.entries if entry.record.kind is RecordKind.CHOICE and entry.sample.time_s >= since_s
    )


def _suspensions(trace: EpisodeTrace, since_s: float) -> Iterator[RecordWithTruth]:
    return (
        entry
        for entry in trace.entries
        if entry.record.data.get("to") == "suspended" and entry.sample.time_s >= since_s
    )


def _onset_s(trace: EpisodeTrace, disturbance: Disturbance) -> float | None:
    """Return when a disturbance first hindered the robot on its path to the target; None if it never did.

    A person first has to walk there, and a disturbance does not count while the robot pursues the other target.
    """
    if not disturbance.target:
        return disturbance.time_s
    for sample in (sample for span in spans(trace, disturbance.target) for sample in span):
        goal = sample.scene.goals.get(disturbance.target)
        if sample.time_s < disturbance.time_s or goal is None:
            continue
        if not disturbance.blocker:
            # a picture that moved before its pursuit began is simply elsewhere
            return sample.time_s if sample.time_s - disturbance.time_s < MOVED_DURING_PURSUIT_S else None
        if disturbance.blocker in _in_the_way(sample.pose[:2], sample, goal):
            return sample.time_s
    return None


def _evaluated(trace: EpisodeTrace, index: int, entry: RecordWithTruth) -> ChoiceEvaluation | None:
    here, choice = entry.sample, str(entry.record.data["choice"])
    goal = here.scene.goals.get(entry.record.target)
    if goal is None:
        return None
    if not _could_be_seen(trace, here, goal):
        return ChoiceEvaluation(FailureCause.ELSEWHERE, choice, None)
    blocking = frozenset(_in_the_way(here.pose[:2], here, goal)) - {goal.name}
    if not blocking:
        return ChoiceEvaluation(FailureCause.MISSED, choice, None)
    remaining_s, detour_s = _remaining_s(trace, here, goal, blocking), _detour_s(here, goal, blocking)
    leaves = math.isfinite(remaining_s) and remaining_s <= detour_s
    cause = FailureCause.BLOCKED_SHORT if leaves else FailureCause.BLOCKED_LONG
    best_s = min(remaining_s, detour_s)
    cost_s = detour_s if choice == FITTING[FailureCause.BLOCKED_LONG] else math.inf
    if choice == FITTING[FailureCause.BLOCKED_SHORT]:
        waited_s = _waited_s(trace, index)
        cost_s = waited_s + max(0.0, min(remaining_s - waited_s, detour_s))
    return ChoiceEvaluation(cause, choice, cost_s - best_s if math.isfinite(cost_s) and math.isfinite(best_s) else None)


def _could_be_seen(trace: EpisodeTrace, here: TruthSample, goal: Goal) -> bool:
    """Return whether the picture could be recognised from this place without the late objects."""
    camera = np.array([here.pose[:2]])
    reach = Goal(goal.name, goal.at_mm, goal.facing_deg, goal.centre_height_mm, trace.view_mm, 0.0, VIEW_ANGLE_DEG)
    plan = _without(here.scene.plan, trace.late_objects)
    return bool(reach.covers(camera)[0] and plan.sees(camera, goal)[0])


def _in_the_way(place: tuple[float, float], sample: TruthSample, goal: Goal) -> list[str]:
    return [each.name for each in sample.scene.plan.in_the_way(place, goal.at_mm, ROBOT_RADIUS_MM)]


def _without(plan: FloorPlan, names: frozenset[str]) -> FloorPlan:
    return replace(plan, obstacles=tuple(each for each in plan.obstacles if each.name not in names))


def _remaining_s(trace: EpisodeTrace, here: TruthSample, goal: Goal, blocking: frozenset[str]) -> float:
    """Return how much longer the straight path from here stays blocked; infinity if to the end."""
    for sample in trace.samples:
        if sample.time_s > here.time_s and not blocking & set(_in_the_way(here.pose[:2], sample, goal)):
            return sample.time_s - here.time_s
    return math.inf


def _detour_s(here: TruthSample, goal: Goal, blocking: frozenset[str]) -> float:
    """Return how much longer the detour takes than the straight path; infinity if there is no detour."""
    plan = here.scene.plan
    paths = [each.path(here.pose[:2], goal, ROBOT_RADIUS_MM) for each in (plan, _without(plan, blocking))]
    round_s, straight_s = (
        math.inf if path is None else path.duration_s(here.pose.heading_deg, LIMITS) for path in paths
    )
    return max(0.0, round_s - straight_s) if math.isfinite(round_s) else math.inf


def _waited_s(trace: EpisodeTrace, index: int) -> float:
    """Return the time from a choice to the next search or approach."""
    begun_s = trace.entries[index].sample.time_s
    later = (
        entry for entry in trace.entries[index + 1 :] if entry.record.data.get("to") in ("search", "arrive", "finished")
    )
    return next((entry.sample.time_s - begun_s for entry in later), trace.duration_s - begun_s)
