"""Evaluate the outcome for each target by the ground truth. Definitions: docs/evaluation.md."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

from behaviors.journal import RecordKind
from nxtdrive.motion.drive_settings import USUAL
from sim_backend.evaluation import stop_counts
from sim_backend.scenarios.floor_plan import MotionLimits, Path
from sim_backend.scenarios.room_builder import ROBOT_RADIUS_MM

from .truth_recorder import EpisodeTrace, TruthSample

LIMITS = MotionLimits(USUAL.speed_mm_s, USUAL.acceleration_mm_s2, USUAL.turn_deg_s, USUAL.turn_acceleration_deg_s2)
"""The rover's own limits; they give the duration of the fastest path."""


@dataclass(frozen=True, slots=True)
class TargetResult:
    """The outcome for one target.

    Attributes:
        target: Its name.
        reachable: Whether it exists.
        success: Whether the robot stopped for it where a stop counts.
        wrong_stops: How often the robot stopped elsewhere and reported an arrival.
        time_s: Mission time of the success; None without one.
        given_up_s: Mission time at which it was given up last; None if it never was, or was reached.
        pursuit_s: Time spent on it.
        path_mm: Length of the path driven for it.
        shortest_mm: Shortest path from the start of its pursuit; None without a path or a pursuit.
        spl: Success weighted by path length (Anderson et al. 2018).
        soft_spl: The same with the share of the path covered in place of success.
        sct: Success weighted by completion time (Yokoyama et al. 2021).
    """

    target: str
    reachable: bool
    success: bool
    wrong_stops: int
    time_s: float | None
    given_up_s: float | None
    pursuit_s: float
    path_mm: float
    shortest_mm: float | None
    spl: float
    soft_spl: float
    sct: float


def evaluate_target(trace: EpisodeTrace, target: str) -> TargetResult:
    """Evaluate the outcome for one target of a mission."""
    pursuits = spans(trace, target)
    claims = _entries(trace, target, "reached")
    right = [claim for claim in claims if stop_counts(claim.pose, claim.scene, target)]
    given_up = _entries(trace, target, "left", "gave_up")
    path_mm = sum(math.dist(one.pose[:2], other.pose[:2]) for span in pursuits for one, other in pairwise(span))
    pursuit_s = sum(span[-1].time_s - span[0].time_s for span in pursuits)
    end = right[0] if right else (pursuits[-1][-1] if pursuits else None)
    path = _longest(pursuits[0][0], end, target) if end else None
    left = _path(end, end, target) if end and not right else None
    economy = 0.0 if path is None else _share(path.length_mm, path_mm)
    fastest_s = 0.0 if path is None else path.duration_s(pursuits[0][0].pose.heading_deg, LIMITS)
    covered = 0.0 if path is None or left is None else max(0.0, 1.0 - left.length_mm / max(path.length_mm, 1.0))
    return TargetResult(
        target=target,
        reachable=any(target in sample.scene.goals for sample in trace.samples),
        success=bool(right),
        wrong_stops=len(claims) - len(right),
        time_s=right[0].time_s if right else None,
        given_up_s=given_up[-1].time_s if given_up and not right else None,
        pursuit_s=pursuit_s,
        path_mm=path_mm,
        shortest_mm=None if path is None else path.length_mm,
        spl=economy if right else 0.0,
        soft_spl=economy if right else economy * covered,
        sct=_share(fastest_s, pursuit_s) if right else 0.0,
    )


def _entries(trace: EpisodeTrace, target: str, *states: str) -> list[TruthSample]:
    """Return the samples at which one of some states was entered for a target."""
    return [
        entry.sample
        for entry in trace.entries
        if entry.record.kind is RecordKind.TRANSITION
        and entry.record.target == target
        and entry.record.data["to"] in states
    ]


def spans(trace: EpisodeTrace, target: str) -> list[list[TruthSample]]:
    """Return the stretches of the mission during which it pursued a target."""
    found = []
    turns = [next(group) for _, group in groupby(trace.entries, key=lambda entry: entry.record.target)]
    for i, turn in enumerate(turns):
        if turn.record.target == target:
            end = turns[i + 1].sample if i + 1 < len(turns) else trace.entries[-1].sample
            between = [m for m in trace.samples if turn.sample.time_s < m.time_s < end.time_s]
            found.append([turn.sample, *between, end])
    return found


def _longest(begin: TruthSample, end: TruthSample, target: str) -> Path | None:
    """Return the shortest path to where the picture was at the end, or at first if that is longer.

    If there was none at the beginning, as when a person stands in the only door, it is that of the end.
    """
    paths = [path for sample in (begin, end) if (path := _path(begin, sample, target)) is not None]
    later = replace(begin, scene=end.scene)
    return max(paths, key=lambda path: path.length_mm, default=None) or _path(later, end, target)


def _path(begin: TruthSample, end: TruthSample, target: str) -> Path | None:
    """Return the shortest path, among the obstacles of the beginning, to where the picture was at the end."""
    goal = end.scene.goals.get(target)
    if goal is None:
        return None
    # the centre of a robot that faces the picture is this much farther away than its camera
    goal = replace(goal, reach_mm=goal.reach_mm + end.scene.plan.camera.forward_mm)
    return begin.scene.plan.path(begin.pose[:2], goal, ROBOT_RADIUS_MM)


def _share(best: float, actual: float) -> float:
    """Return the ratio of the best to the actual value, at most 1."""
    return 1.0 if actual <= best else best / actual
