"""Estimate the sonar's place, beam and error from echoes of the wall on which the sheet hangs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nxtdrive.motion.wheel_geometry import mm_per_degree

from .course import CalibrationRefused
from .track import Array, Track, at_times, poses

STRAIGHT_DEG = 8.0
"""Echoes count only when the robot faces the wall this well: then the whole beam hits it at about the same distance."""
MIN_ECHOES = 20
"""Echoes that an estimate needs."""
MAX_ANGLE_DEG = 35.0
"""At larger angles the echo may be of another wall."""
BEYOND_DEG = 4.0
"""The beam's edge is known when there are enough echoes from beyond it, by this at least."""
HALF_ANGLES_DEG = np.arange(2.0, MAX_ANGLE_DEG, 0.25)
"""Half angles of the beam that are tried."""
RESOLUTION_MM = 10.0
"""The sensor gives whole centimetres; how it rounds is not known."""
NOISIEST_MM = 50.0
"""Echoes that scatter more do not follow the wall's distance: the sensor is stuck, or other things reflect."""
DRIVEN_MM = 150.0
"""How much the distance of the wall must change for a comparison of the sonar with the sheet."""
ANOTHER_SIZE = 0.025
"""Distances by sonar and sheet that differ by a larger share are doubted. From 10 to 30 degrees Celsius the speed of
sound differs by less from that at 20; a sheet that was printed to fit a page is 3 to 6 % too small."""
LEAST_SCALE = 0.3
"""Echoes whose distance changes by a smaller share of the wall's do not follow it."""
REMEDY = "Check the sonar with `nxtdrive sensor`, and its cable and port; hang the sheet on a wall that reflects sound."
OUTLIER = 3.0
"""Errors count up to this many standard deviations."""
GROUPS = 5
"""Parts of the echoes, each of which is left out once (jackknife)."""
UNEVEN_DEG = 3.0
"""Standard error of the beam's angle through walls that are not plane, such as by the sheet, or a skirting board."""


class SheetRefused(CalibrationRefused):
    """The sheet has not the size by which everything is measured."""


@dataclass(frozen=True, slots=True)
class SonarEstimate:
    """The estimate.

    Attributes:
        forward_mm: The sonar in front of the axle.
        standard_error_mm: Of that, with the rounding to whole centimetres.
        noise_mm: Standard deviation of single echoes.
        echoes: Number of echoes used.
        cone_deg: Whole angle of its beam, and the standard error of that; None where the wall gives no echo aslant.
        scale: Distances by the sonar over those that follow from the sheet's size; None if the robot hardly drove.
    """

    forward_mm: float
    standard_error_mm: float
    noise_mm: float
    echoes: int
    cone_deg: tuple[float, float] | None
    scale: float | None


def size_doubt(scale: float | None) -> str:
    """Return a warning that the sheet may not have its nominal size; empty without evidence by the sonar."""
    if scale is None or abs(scale - 1.0) <= ANOTHER_SIZE:
        return ""
    return (
        f"the sonar measures {scale:.0%} of the distances that follow from its size. If the line below the markers is "
        "not 100 mm long, print it at 100 % and calibrate again."
    )


def estimate_sonar(track: Track, values: dict[str, float]) -> SonarEstimate:
    """Estimate the sonar's place.

    Args:
        track: What was recorded.
        values: Wheels and the sheet's place, as `camera_and_wheels.estimate` found them.

    Raises:
        CalibrationRefused: There are too few echoes with the wall straight ahead, or they are not of the wall.
        SheetRefused: They differ so much from what follows from the sheet that its size is wrong.
    """
    mm_per_deg = mm_per_degree(values["wheel_diameter_mm"], values["wheel_mismatch_percent"])
    path = poses(np.asarray(track.counts), mm_per_deg, values["axle_track_mm"])
    times, ranges = np.asarray(track.ranges, np.float64).reshape(-1, 2).T
    x, y, heading = at_times(path, times)
    turn = math.radians(values["sheet_turn_deg"])
    off = np.remainder(heading - turn + math.pi, 2 * math.pi) - math.pi
    wall_mm = (values["sheet_x_mm"] - x) * math.cos(turn) + (values["sheet_y_mm"] - y) * math.sin(turn)
    facing = np.abs(off) < math.radians(STRAIGHT_DEG)
    if (echoes := int(facing.sum())) < MIN_ECHOES:
        raise CalibrationRefused(
            f"the sonar gave {echoes} echoes with the wall straight ahead, and {MIN_ECHOES} are needed.", remedy=REMEDY
        )
    forward = (wall_mm - ranges)[facing] / np.cos(off[facing])
    middle = float(np.median(forward))
    noise = max(1.0, float(1.4826 * np.median(np.abs(forward - middle))))
    scale = _scale(wall_mm[facing], ranges[facing])
    if noise > NOISIEST_MM:
        if scale is not None and scale > LEAST_SCALE and (doubt := size_doubt(scale)):
            raise SheetRefused(f"the sheet has another size: {doubt}")
        raise CalibrationRefused(
            f"the sonar's echoes scatter by {noise:.0f} mm round the wall's distance.", remedy=REMEDY
        )
    error = math.hypot(1.25 * noise / math.sqrt(echoes), RESOLUTION_MM / math.sqrt(12))
    upright_mm = wall_mm - middle * np.cos(off)
    cone_deg = _cone(np.degrees(np.abs(off)), upright_mm, ranges, noise)
    return SonarEstimate(middle, error, noise, echoes, cone_deg, scale)


def _scale(wall_mm: Array, ranges: Array) -> float | None:
    """Return by how much ranges change with the distance of the wall, as a share; None if that hardly changes."""
    if np.ptp(wall_mm) < DRIVEN_MM:
        return None
    used = np.full(len(ranges), fill_value=True)
    for _ in range(3):
        slope, start = np.polyfit(wall_mm[used], ranges[used], 1)
        off_mm = np.abs(ranges - slope * wall_mm - start)
        used = off_mm <= max(RESOLUTION_MM, OUTLIER * 1.4826 * float(np.median(off_mm)))
    return float(slope)


def _cone(off_deg: Array, upright_mm: Array, ranges: Array, noise_mm: float) -> tuple[float, float] | None:
    """Return the whole angle of the beam and its standard error.

    While part of the beam meets the wall at a right angle, the range stays the same as the robot turns; beyond, the
    edge of the beam is nearest to the wall, and the range grows.
    """
    used = off_deg < MAX_ANGLE_DEG
    off_deg, upright_mm, ranges = off_deg[used], upright_mm[used], ranges[used]
    aside = np.radians(np.maximum(0.0, off_deg - HALF_ANGLES_DEG[:, None]))
    losses = np.minimum(np.abs(ranges - upright_mm / np.cos(aside)) / noise_mm, OUTLIER)
    half = float(HALF_ANGLES_DEG[losses.sum(axis=1).argmin()])
    if (off_deg > half + BEYOND_DEG).sum() < MIN_ECHOES:
        return None
    group = np.arange(len(off_deg)) % GROUPS
    others = [float(HALF_ANGLES_DEG[losses[:, group != each].sum(axis=1).argmin()]) for each in range(GROUPS)]
    error = math.sqrt((GROUPS - 1) / GROUPS * sum((each - half) ** 2 for each in others))
    return 2 * half, math.hypot(2 * error, UNEVEN_DEG)
