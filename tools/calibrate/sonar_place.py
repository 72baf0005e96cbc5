"""Estimates where the sonar is and how much it errs, from echoes of the wall on which the sheet hangs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nxtdrive.motion.wheel_geometry import mm_per_degree

from .track import Track, at_times, poses

STRAIGHT_DEG = 8.0
"""Echoes count only when the robot faces the wall this well: then the whole beam hits it at about the same distance."""
FEWEST = 20


@dataclass(frozen=True, slots=True)
class SonarEstimate:
    """What was estimated.

    Attributes:
        forward_mm: The sonar in front of the axle.
        standard_error_mm: Of that.
        noise_mm: Standard deviation of single echoes.
        echoes: Number of echoes used.
    """

    forward_mm: float
    standard_error_mm: float
    noise_mm: float
    echoes: int


def estimate_sonar(track: Track, values: dict[str, float]) -> SonarEstimate | None:
    """Estimate the sonar's place; None with too few echoes from straight before the wall.

    Args:
        track: What was recorded.
        values: Wheels and the sheet's place, as `camera_and_wheels.estimate` found them.
    """
    if not track.ranges:
        return None
    mm_per_deg = mm_per_degree(values["wheel_diameter_mm"], values["wheel_mismatch_percent"])
    path = poses(np.asarray(track.counts), mm_per_deg, values["axle_track_mm"])
    times, ranges = np.asarray(track.ranges).T
    x, y, heading = at_times(path, times)
    turn = math.radians(values["sheet_turn_deg"])
    off = np.remainder(heading - turn + math.pi, 2 * math.pi) - math.pi
    wall_mm = (values["sheet_x_mm"] - x) * math.cos(turn) + (values["sheet_y_mm"] - y) * math.sin(turn)
    facing = np.abs(off) < math.radians(STRAIGHT_DEG)
    if facing.sum() < FEWEST:
        return None
    forward = (wall_mm - ranges)[facing] / np.cos(off[facing])
    middle = float(np.median(forward))
    noise = max(1.0, float(1.4826 * np.median(np.abs(forward - middle))))
    return SonarEstimate(middle, 1.25 * noise / math.sqrt(facing.sum()), noise, int(facing.sum()))
