"""Distances along the floor from the angles at which a camera sees it end, and how exact they are.

The camera looks down on the floor, so an angle below the horizontal is a distance. A camera that is tilted by a few
degrees, or whose field of view differs from the description, makes all of them wrong: the angle is `offset + scale *
angle`. Both are learned from what sonar and camera measure at once. Until then only near distances are used. Often the
two do not measure the same thing, so the filter is a grid of hypotheses, pairs of offset and scale, and the likelihood
of a measurement is a mixture of a normal distribution and a uniform one for outliers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from behaviors.mission.robot import CameraTable
from behaviors.ports import FloorRay, Pose

Array = NDArray[np.float64]

OFFSET_SD_DEG = 2.0
"""Standard deviation of the camera's tilt: taped or clamped by hand. A guess."""
CALIBRATED_SD_DEG = 0.5
"""The same of a camera that was calibrated. Source: docs/calibration.md."""
SCALE_SD = 0.25
"""Standard deviation of the scale of angles: of the lens's height by eye. A guess."""
MEASURED_SCALE_SD = 0.1
"""The same where the mission states that height: of a webcam's field of view by its data sheet."""
CALIBRATED_SCALE_SD = 0.02
"""The same of a camera that was calibrated."""
YAW_SD_DEG = 2.5
"""Standard deviation of the direction in which the camera looks."""
CALIBRATED_YAW_SD_DEG = 1.0
"""The same of a camera that was calibrated."""
LATENCY_SD_S = 0.1
"""Standard deviation of the time that frames take: a turning robot sees where it looked before."""
CALIBRATED_LATENCY_SD_S = 0.03
"""The same of a camera that was calibrated."""
EXACT_MM = 120.0
"""The end of the floor is only a hint if it may be farther to the side than this."""
NOISE_DEG = 0.5
"""Standard deviation of the difference between camera and sonar. Measurements of one wall are correlated, so it is not
smaller."""
OUTLIER_CHANCE = 0.4
"""Chance that camera and sonar measured two different things: what looks like the floor, or is lower than the beam."""
OUTLIER_SPAN_DEG = 40.0
"""The angles of two different things differ by anything within this span."""
GRID_SDS = 5.0
"""The grid of hypotheses reaches this many standard deviations to either side."""
GRID_STEPS = 101
"""Number of hypotheses along each axis of that grid."""
TABLE_STEP_MM = 50.0
"""Distances are tried in these steps."""
NEAREST_RAYS = 3
"""Number of rays in the beam, those that end nearest, whose middle one is compared with the echo."""
AHEAD_DEG = 6.0
"""That ray has to be this near to the axis, since the beam fades to the sides."""
NEAREST_MM = 400.0
"""Echoes from nearer than this are not compared."""
FARTHEST_MM = 1500.0
"""Echoes from farther away than this are not compared."""
MOVED_MM = 100.0
TURNED_DEG = 10.0
"""After a comparison the robot has to drive or to turn this far for another one."""
RAY_SD_DEG = 0.15
"""Standard deviation of one ray's angle. Source: docs/ranges.md section 3."""
ERROR_MM = 200.0
"""Distances that may be wrong by more than this are not used."""
FARTHEST_USED_MM = 3000.0
"""Larger distances than this are not used either."""
FLOOR_LIKE_SDS = 2.0
"""A ray that ends this many standard deviations above the horizon ends at something that looks like the floor."""


@dataclass(frozen=True, slots=True)
class VisibleFloor:
    """The free floor by bearing, (n,) each but for the last two, (m,).

    Attributes:
        bearing_deg: From the robot's forward axis, positive right.
        near_mm: From the lens to the nearest floor in the frame.
        free_mm: Up to where it is certainly free.
        end_mm: To where something stands; infinity where that is not known well enough.
        exact: Whether its direction is known to about a cell of the map.
        floor_like_deg: Bearings in which something that looks like the floor stands at an unknown distance.
        floor_like_near_mm: From the lens to the nearest floor in the frame there.
    """

    bearing_deg: Array
    near_mm: Array
    free_mm: Array
    end_mm: Array
    exact: NDArray[np.bool_]
    floor_like_deg: Array = field(default_factory=lambda: np.empty(0))
    floor_like_near_mm: Array = field(default_factory=lambda: np.empty(0))


class FloorRanges:
    """Turns angles into distances.

    Args:
        camera: How the camera is mounted.
        sonar_ahead_mm: The sonar in front of the lens.
        beam_deg: An echo comes from within this angle of the sonar's axis.
        calibrated: Whether the camera was calibrated.
    """

    def __init__(self, camera: CameraTable, sonar_ahead_mm: float, beam_deg: float, *, calibrated: bool) -> None:
        self._height_mm, self._sonar_ahead_mm, self._beam_deg = camera.height_mm, sonar_ahead_mm, beam_deg
        sd_deg = CALIBRATED_SD_DEG if calibrated else OFFSET_SD_DEG
        scale_sd = MEASURED_SCALE_SD if "height_mm" in camera.model_fields_set else SCALE_SD
        if calibrated:
            scale_sd = CALIBRATED_SCALE_SD
        span = np.linspace(-GRID_SDS, GRID_SDS, GRID_STEPS)
        offset, scale = np.meshgrid(sd_deg * span, 1.0 + scale_sd * span)
        self._hypotheses = np.stack([offset.ravel(), scale.ravel()])
        self._log_posterior = -(np.add.outer(span**2, span**2).ravel()) / 2
        step = span[1] - span[0]
        self._within_step = np.diag([(sd_deg * step) ** 2, (scale_sd * step) ** 2]) / 12
        self._summarise()
        self._yaw_sd_deg = CALIBRATED_YAW_SD_DEG if calibrated else YAW_SD_DEG
        self._latency_sd_s = CALIBRATED_LATENCY_SD_S if calibrated else LATENCY_SD_S
        self._compared_at: Pose | None = None

    def measure(self, rays: Sequence[FloorRay], turn_deg_s: float = 0.0) -> VisibleFloor:
        """Return the distances along some rays, of a robot that turns at this rate."""
        angles = np.array([(ray.bearing_deg, ray.near_deg, ray.end_deg) for ray in rays], np.float64).reshape(-1, 3)
        offset, scale = self._mean
        below_deg = offset + scale * angles[:, 2]
        floor_like = below_deg < -FLOOR_LIKE_SDS * self._sd_deg(angles[:, 2])
        floor_like_deg, floor_like_near_deg, _ = angles[floor_like].T
        bearing, near, end = angles[~floor_like & ((below_deg > 0.0) | (angles[:, 2] > 0.0))].T
        end_mm = self._distance_mm(offset + scale * end)
        error_mm = self._error_mm(end, end_mm)
        known = (error_mm <= ERROR_MM) & (end_mm <= FARTHEST_USED_MM)
        free_mm = np.minimum(end_mm, self._sure_mm) - np.minimum(error_mm, ERROR_MM)
        aside_deg = math.hypot(self._yaw_sd_deg, turn_deg_s * self._latency_sd_s)
        free_mm = _least_beside(free_mm, bearing, aside_deg)
        exact = end_mm * math.radians(aside_deg) <= EXACT_MM
        near_mm = self._distance_mm(offset + scale * near)
        floor_like_near_mm = self._distance_mm(offset + scale * floor_like_near_deg)
        end_mm = np.where(known, end_mm, np.inf)
        return VisibleFloor(bearing, near_mm, free_mm, end_mm, exact, floor_like_deg, floor_like_near_mm)

    def compare(self, rays: Sequence[FloorRay], pose: Pose, range_mm: float, off_deg: float = 0.0) -> None:
        """Learn from a frame and an echo.

        Args:
            rays: The free floor in the frame.
            pose: The robot's at the frame.
            range_mm: The echo, as it would have been measured from there.
            off_deg: Bearing of its source: the robot may have turned since the frame.
        """
        if not NEAREST_MM <= range_mm <= FARTHEST_MM:
            return
        if self._compared_at is not None and pose.is_near(self._compared_at, MOVED_MM, TURNED_DEG):
            return
        ended = [(ray.end_deg, ray.bearing_deg) for ray in rays if ray.end_deg > 0.0]
        beam = sorted(each for each in ended if abs(each[1] - off_deg) <= self._beam_deg)
        if len(beam) < NEAREST_RAYS:
            return
        # an echo is of what is nearest in the beam
        seen_deg, bearing_deg = beam[-(NEAREST_RAYS + 1) // 2]
        if abs(bearing_deg - off_deg) > AHEAD_DEG:
            return
        self._compared_at = pose
        self._update(seen_deg, math.degrees(math.atan2(self._height_mm, range_mm + self._sonar_ahead_mm)))

    def _update(self, seen_deg: float, real_deg: float) -> None:
        offset, scale = self._hypotheses
        error = (offset + scale * seen_deg - real_deg) / NOISE_DEG
        same_thing = np.exp(-(error**2) / 2) / (NOISE_DEG * math.sqrt(2 * math.pi))
        self._log_posterior += np.log((1.0 - OUTLIER_CHANCE) * same_thing + OUTLIER_CHANCE / OUTLIER_SPAN_DEG)
        self._summarise()

    def _summarise(self) -> None:
        """Compute mean and covariance of offset and scale, and up to where distances are known to `error_mm`."""
        chance = np.exp(self._log_posterior - self._log_posterior.max())
        self._mean = np.average(self._hypotheses, axis=1, weights=chance)
        self._covariance = np.cov(self._hypotheses, aweights=chance, ddof=0) + self._within_step
        away_mm = np.arange(TABLE_STEP_MM, FARTHEST_USED_MM + 1.0, TABLE_STEP_MM)
        offset, scale = self._mean
        seen_deg = (np.degrees(np.arctan2(self._height_mm, away_mm)) - offset) / scale
        known = self._error_mm(seen_deg, away_mm) <= ERROR_MM
        self._sure_mm = float(away_mm[known].max(initial=0.0))

    def _error_mm(self, seen_deg: Array, away_mm: Array) -> Array:
        """Return the standard deviations of the distances of rays that are seen at these angles."""
        error_deg = self._sd_deg(seen_deg)
        return np.asarray(np.radians(error_deg) * (away_mm**2 + self._height_mm**2) / self._height_mm)

    def _sd_deg(self, seen_deg: Array) -> Array:
        """Return the standard deviations of the true angles of rays that are seen at these angles."""
        terms = np.stack([np.ones_like(seen_deg), seen_deg])
        variance = np.einsum("in,ij,jn->n", terms, self._covariance, terms) + RAY_SD_DEG**2
        return np.asarray(np.sqrt(variance))

    def _distance_mm(self, below_deg: Array) -> Array:
        """Return the distances at which rays meet the floor; those that hardly point down never do."""
        tangent = np.tan(np.radians(np.clip(below_deg, 0.1, 89.0)))
        return np.asarray(self._height_mm / tangent)


def _least_beside(values: Array, bearing_deg: Array, within_deg: float) -> Array:
    """Return for each bearing the least of the values at bearings within an angle of it."""
    beside = np.abs(bearing_deg[:, None] - bearing_deg[None, :]) <= within_deg
    return np.asarray(np.where(beside, values[None, :], np.inf).min(axis=1, initial=np.inf))
