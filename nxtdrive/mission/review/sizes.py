"""Hints at distances by the size in the picture that are wrong, and with them a height or the field of view."""

from __future__ import annotations

import math

from behaviors.adaptive.bounded_sighting import BEAM_DEG
from behaviors.events import Reason
from behaviors.mission.targets import MarkerTarget, PictureTarget, QrTarget
from behaviors.plausibility import TOLERANCE_MM, contradicts
from behaviors.profile_names import THESIS
from nxtdrive.mission.review.reviewed_run import Distances, Hints, ReviewedRun, Transition

STOPS_BEFORE_WARNING = 2
"""A target in front of which the robot was stopped this many times may be nearer than its size says."""
STOPPED = (Reason.BLOCKED_SHORT, Reason.BLOCKED_LONG)
FLAT_TARGETS = (PictureTarget, MarkerTarget, QrTarget)
SCALE_TOLERANCE = 0.25
"""A hint says so if driving or the truth shows that distances by size are wrong by more: a field of view from a data
sheet and a height by ruler together may be wrong by less."""


def size_at_arrival(run: ReviewedRun, transition: Transition) -> Hints:
    """Check at an arrival whether the echo contradicts the size."""
    if not transition.evidence.get("passes_over") and (distances := _contradiction(run, transition.target)):
        yield transition.target, _wrong_size(run, transition.target, distances)


def range_mismatch(run: ReviewedRun, transition: Transition) -> Hints:
    """Check whether a skill found that the echo contradicts a size, unless that is known to be right."""
    if transition.reason != Reason.RANGE_MISMATCH:
        return
    range_mm, distance_mm = (transition.evidence.get(name) for name in ("range_mm", "distance_mm"))
    if range_mm is not None and distance_mm is not None and not _is_true(run, transition.target, distance_mm):
        yield transition.target, _wrong_size(run, transition.target, (range_mm, distance_mm))


def note_stop(run: ReviewedRun, transition: Transition) -> None:
    """Note a stop before a target that its size says is farther away."""
    distances = _contradiction(run, transition.target) if transition.reason in STOPPED else None
    if distances and distances[0] < distances[1]:
        run.stops[transition.target].append(distances)


def stops_before_target(run: ReviewedRun) -> Hints:
    """Check at the end whether the robot was stopped repeatedly before a target that its size says is farther away."""
    for target, stops in run.stops.items():
        if target not in run.reached and len(stops) >= STOPS_BEFORE_WARNING:
            yield target, _wrong_size(run, target, stops[-1])


def scale(run: ReviewedRun, transition: Transition) -> Hints:
    """Check at an arrival whether driving or the truth shows sizes to be wrong by more than data sheets allow."""
    target, known = transition.target, 1.0 if transition.sighting.get("bound") else _true_share(run)
    factor = known * transition.evidence.get("scale", 1.0)
    if abs(math.log(factor)) > math.log(1.0 + SCALE_TOLERANCE):
        height_mm, hfov_deg = run.mission.target[target].height_mm, run.mission.camera.hfov_deg
        text = (
            f"{target}: its size in the picture gave {1 / factor:.2g} times the true distance. Is "
            f"height_mm = {height_mm:g} right? It may be about {float(f'{height_mm * factor:.2g}'):g} mm high; or "
            f"hfov_deg = {hfov_deg:g} is wrong, which `nxtdrive calibrate camera` measures."
        )
        yield target, text


def _true_share(run: ReviewedRun) -> float:
    """Return the last arrival's true distance over the estimate; 1 without the truth, and in front of what is not flat.

    A camera sees the top of a box as well, so the box looks higher than it is.
    """
    arrival = run.arrivals[-1]
    flat = isinstance(run.mission.target[arrival["target"]], FLAT_TARGETS)
    if not flat or not arrival.get("there") or not arrival["believed_mm"]:
        return 1.0
    return float(arrival["true_mm"] / arrival["believed_mm"])


def _contradiction(run: ReviewedRun, target: str) -> Distances | None:
    """Return the distances of the last look, if they contradict each other.

    In the simulator the echo may be known to come from something else, such as what is in the way.
    """
    sighting, range_mm = run.look.get("sighting"), run.look.get("range_mm")
    if sighting is None or sighting.get("bound") or range_mm is None or abs(sighting["bearing_deg"]) > BEAM_DEG:
        return None
    distance_mm, thesis = sighting["distance_mm"], run.mission.mission.profile == THESIS
    tolerance_mm = TOLERANCE_MM if thesis else run.mission.adaptive.sonar_tolerance_mm
    wrong = contradicts(range_mm, distance_mm, tolerance_mm) and not _is_true(run, target, distance_mm)
    return (range_mm, distance_mm) if wrong else None


def _is_true(run: ReviewedRun, target: str, distance_mm: float) -> bool:
    """Return whether a distance by size is known to be right."""
    truth = run.truth
    return truth is not None and any(
        truth.in_front_of_camera(name) and not contradicts(truth.lens_distance_mm(name), distance_mm)
        for name in run.lookalikes(target)
    )


def _wrong_size(run: ReviewedRun, target: str, distances: Distances) -> str:
    (range_mm, distance_mm), height_mm = distances, run.mission.target[target].height_mm
    fits_mm = float(f"{height_mm * (range_mm + run.mission.sonar_ahead_mm) / distance_mm:.2g}")
    return (
        f"{target}: the sonar says {range_mm / 1000:.1f} m, its size in the picture says "
        f"{distance_mm / 1000:.1f} m. Is height_mm = {height_mm:g} right? "
        f"If the echo came from {target}, it is about {fits_mm:g} mm high."
    )
