"""Estimate camera and wheels together, from the camera's views of the marker sheet while the wheels turned.

One model predicts where each corner of a marker appears in each frame: counts, diameter, mismatch and track give the
robot's path; the pose at the time of exposure, which the latency gives, and the camera's mounting give the
view. The parameters are those that fit the corners best. The sheet's size is the only length that is known; its
place is estimated as well. Different motions separate the parameters: full turns on the spot give track over diameter,
turns at two distances the field of view and the lens's place, a straight drive the diameter and, by its direction in
the frame, the yaw, the axis of turning tilt and roll, turns to both sides the latency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from behaviors.mission.robot import CameraTable, RobotTable
from firmware_protocol.wording import number_of
from nxtdrive.motion.wheel_geometry import mm_per_degree

from .course import REMEDY, CalibrationRefused
from .least_squares import Array, Fit, fit
from .track import Track, at_times, poses, smoothed

PARAMETERS = {
    # name: first guess or None where the robot's description has it, its standard deviation, a small change
    "hfov_deg": (None, 12.0, 0.01),
    "yaw_deg": (None, 15.0, 0.01),
    "tilt_deg": (None, 12.0, 0.01),
    "roll_deg": (None, 12.0, 0.01),
    "forward_mm": (None, 120.0, 0.1),
    "right_mm": (None, 60.0, 0.1),
    "latency_s": (None, 0.3, 1e-4),
    "wheel_diameter_mm": (None, 10.0, 0.005),
    "wheel_mismatch_percent": (None, 2.0, 0.002),
    "axle_track_mm": (None, 30.0, 0.01),
    "sheet_x_mm": (1000.0, 600.0, 0.1),
    "sheet_y_mm": (0.0, 600.0, 0.1),
    "above_mm": (0.0, 150.0, 0.1),
    "sheet_turn_deg": (0.0, 30.0, 0.01),
    "sheet_roll_deg": (0.0, 3.0, 0.01),
    "sheet_lean_deg": (0.0, 2.0, 0.01),
    "blur_px": (0.0, 0.3, 0.001),
}
"""``above_mm``: the lens above the middle of the sheet. The sheet is turned clockwise, rolled clockwise as seen from
before it, and leans with its upper edge towards the robot. ``blur_px``: the detector finds the corners of a black
square too far inside by this."""
NAMES = tuple(PARAMETERS)
PRIOR_SD, SCALES = (np.array(column) for column in list(zip(*PARAMETERS.values(), strict=True))[1:])
CAMERA_KEYS = ("hfov_deg", "yaw_deg", "tilt_deg", "roll_deg", "forward_mm", "right_mm", "latency_s")
WHEEL_KEYS = ("wheel_diameter_mm", "wheel_mismatch_percent", "axle_track_mm")
LATENCIES_S = (0.05, 0.2, 0.4)
"""First guesses of the latency; the one that fits best counts."""
FEW_VIEWS, MANY_VIEWS = 60, 200
"""Views used to find the first guess, and the best values."""
MIN_VIEWS = 60
"""Views from steady motion that an estimate needs."""
SLIP_EVERY_DEG, SLIP_DEG = 300.0, 0.05
"""Length of a stretch of motion, as the sum of both wheels' turns, and the standard deviation of the turn by slipping
during one."""
CERTAIN = 1e-6
"""Standard deviation of a parameter that is not to be estimated."""
NEAREST_MM = 30.0
"""Corners nearer than this, or behind the lens, are projected as from here, so that a poor guess gives no infinite
pixels."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """The estimate.

    Attributes:
        values: By the name of the parameter.
        standard_errors: Of each.
        residual_px: Robust standard deviation of the distance between predicted and measured corners, per axis.
        views: Frames in which the sheet was seen.
        converged: Whether the fit found a minimum.
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    residual_px: float
    views: int
    converged: bool


class Corners:
    """The corners of all views of a track as arrays, and where parameters predict them.

    Args:
        track: What was recorded.
        most: The number of views that are used, at most.

    Attributes:
        per_view: Corners in a view, on average.
    """

    def __init__(self, track: Track, most: int) -> None:
        views = track.views[:: max(1, math.ceil(len(track.views) / most))]
        counts = np.asarray(track.counts, np.float64)
        self._slips, self._counts = _slips(counts), smoothed(counts)
        self._width, self._height = track.size
        # an error of the pose in a frame affects all its corners
        per_view = [len(view.seen.on_sheet_mm) for view in views]
        self.per_view = sum(per_view) / len(views)
        self._times = np.repeat([view.time_s for view in views], per_view)
        self._on_sheet = np.concatenate([view.seen.on_sheet_mm for view in views])
        self._in_frame = np.concatenate([view.seen.in_frame_px for view in views])

    @property
    def slips(self) -> int:
        """Number of parameters for the slip of the wheels."""
        return int(self._slips.shape[1])

    def residuals(self, values: Array) -> Array:
        """Return predicted minus measured pixels, first all columns, then all rows.

        Args:
            values: The parameters of `NAMES`, then the slips, one for each stretch of motion.
        """
        u, v = self.predict(dict(zip(NAMES, values, strict=False)), values[len(NAMES) :])
        return np.concatenate([u - self._in_frame[:, 0], v - self._in_frame[:, 1]])

    def predict(self, p: dict[str, float], slips: Array) -> tuple[Array, Array]:
        """Return the columns and rows of the corners."""
        mm_per_deg = mm_per_degree(p["wheel_diameter_mm"], p["wheel_mismatch_percent"])
        path = poses(self._counts, mm_per_deg, p["axle_track_mm"], self._slips @ np.radians(slips))
        x, y, heading = at_times(path, self._times - p["latency_s"])
        point_x, point_y, down = self._sheet(p)
        ahead = np.cos(heading) * (point_x - x) + np.sin(heading) * (point_y - y) - p["forward_mm"]
        right = np.cos(heading) * (point_y - y) - np.sin(heading) * (point_x - x) - p["right_mm"]
        yaw, tilt, roll = (math.radians(p[name]) for name in ("yaw_deg", "tilt_deg", "roll_deg"))
        ahead, right = ahead * math.cos(yaw) + right * math.sin(yaw), right * math.cos(yaw) - ahead * math.sin(yaw)
        down, ahead = down * math.cos(tilt) + ahead * math.sin(tilt), ahead * math.cos(tilt) - down * math.sin(tilt)
        right, down = right * math.cos(roll) + down * math.sin(roll), down * math.cos(roll) - right * math.sin(roll)
        focal_px = self._width / 2 / math.tan(math.radians(p["hfov_deg"]) / 2)
        scale = focal_px / np.maximum(ahead, NEAREST_MM)
        return _pulled(self._width / 2 + scale * right, self._height / 2 + scale * down, p["blur_px"])

    def _sheet(self, p: dict[str, float]) -> tuple[Array, Array, Array]:
        """Return x, y of the corners in the frame of the start, and how far they are below the lens."""
        roll, lean = math.radians(p["sheet_roll_deg"]), math.radians(p["sheet_lean_deg"])
        across = self._on_sheet[:, 0] * math.cos(roll) - self._on_sheet[:, 1] * math.sin(roll)
        down = self._on_sheet[:, 0] * math.sin(roll) + self._on_sheet[:, 1] * math.cos(roll)
        # the sheet faces back along +x; turned clockwise as seen from above, its right edge comes nearer
        turn = math.radians(p["sheet_turn_deg"])
        behind = down * math.sin(lean)
        x = p["sheet_x_mm"] - across * math.sin(turn) + behind * math.cos(turn)
        y = p["sheet_y_mm"] + across * math.cos(turn) + behind * math.sin(turn)
        return x, y, down * math.cos(lean) + p["above_mm"]


def _pulled(u: Array, v: Array, by_px: float) -> tuple[Array, Array]:
    """Return corners, four for each marker, moved along both axes towards the middle of their marker."""
    away = [(each.reshape(-1, 4) - each.reshape(-1, 4).mean(axis=1, keepdims=True)).ravel() for each in (u, v)]
    scale = by_px * math.sqrt(2) / np.maximum(np.hypot(*away), 1e-9)
    return u - scale * away[0], v - scale * away[1]


def estimate(track: Track, robot: RobotTable, camera: CameraTable, settled_s: float | None = None) -> Estimate:
    """Estimate camera and wheels.

    Args:
        track: What was recorded.
        robot: The robot's description so far; the first guess.
        camera: Its camera's description so far.
        settled_s: Until then there are only small turns; they are fitted first, since after a full turn by a wrong
            track the sheet would be expected elsewhere.

    Raises:
        CalibrationRefused: There are too few views of the sheet.
    """
    early = track if settled_s is None else track.until(settled_s)
    if not early.views:
        raise CalibrationRefused("the sheet was seen in none of the frames.", remedy=REMEDY)
    guesses = [_guess(early, robot, camera, latency_s) for latency_s in LATENCIES_S]
    few = Corners(early, FEW_VIEWS)
    best = min((_fit(few, guess) for guess in guesses), key=lambda found: found.residual)
    seen, track = len(track.views), track.steady(float(best.values[NAMES.index("latency_s")]))
    if (steady := len(track.views)) < MIN_VIEWS:
        frames = f"of {number_of(seen, 'frame')} that show the sheet, {steady} were taken in steady motion"
        raise CalibrationRefused(f"{frames}; {MIN_VIEWS} are needed.", remedy=REMEDY)
    best = _fit(Corners(track, MANY_VIEWS), best.values[: len(NAMES)])
    return Estimate(
        dict(zip(NAMES, map(float, best.values), strict=False)),
        dict(zip(NAMES, map(float, best.standard_errors), strict=False)),
        best.residual,
        len(track.views),
        best.converged,
    )


def believed_values(robot: RobotTable, camera: CameraTable) -> dict[str, float]:
    """Return the robot file's values, by the names of the estimated ones, whose track includes the slip of turns."""
    values = {**camera.model_dump(), **robot.model_dump(), "axle_track_mm": robot.turning_track_mm}
    return {key: float(values[key]) for key in (*CAMERA_KEYS, *WHEEL_KEYS)}


def misfit_px(track: Track, current: dict[str, float], found: dict[str, float]) -> float:
    """Return by how much these values of the robot miss the markers on average, wherever the sheet hangs.

    Args:
        track: What was recorded.
        current: Values of `CAMERA_KEYS` and `WHEEL_KEYS`.
        found: All values that were estimated, for the first guess of the sheet's place.
    """
    corners = Corners(track, FEW_VIEWS)
    start = np.array([current.get(name, found[name]) for name in NAMES])
    best = _fit(corners, start, np.where([name in current for name in NAMES], CERTAIN, PRIOR_SD))
    without_slips = np.concatenate([best.values[: len(NAMES)], np.zeros(corners.slips)])
    return float(np.sqrt(np.mean(corners.residuals(without_slips) ** 2)))


def _fit(corners: Corners, start: Array, prior_sd: Array = PRIOR_SD) -> Fit:
    """Fit the parameters of `NAMES` together with the slips, which are expected to be small."""
    slips = np.ones(corners.slips)
    return fit(
        corners.residuals,
        np.concatenate([start, 0 * slips]),
        np.concatenate([prior_sd, slips]),
        np.concatenate([SCALES, 0.01 * slips]),
        corners.per_view,
    )


def _slips(counts: Array) -> Array:
    """Return how each slip, of expected size 1, turns the robot between two counts, in degrees, (counts - 1, slips).

    Wheels slip a little and at random, unnoticed by odometry. One parameter for each stretch of motion keeps that from
    being attributed to other parameters.
    """
    turned_deg = np.abs(np.diff(counts[:, 1:], axis=0)).sum(axis=1)
    stretch = np.floor(np.cumsum(turned_deg) / SLIP_EVERY_DEG).astype(int)
    shares = np.zeros((len(turned_deg), int(stretch.max(initial=0)) + 1))
    shares[np.arange(len(turned_deg)), stretch] = turned_deg / SLIP_EVERY_DEG * SLIP_DEG
    return shares


def _guess(track: Track, robot: RobotTable, camera: CameraTable, latency_s: float) -> Array:
    """Return a first guess of the parameters of `NAMES`."""
    current = believed_values(robot, camera)
    start = {name: current[name] if value is None else value for name, (value, _, _) in PARAMETERS.items()}
    start["latency_s"] = latency_s
    seen = track.views[0].seen
    span_mm = float(np.ptp(seen.on_sheet_mm[:, 0]) + np.ptp(seen.on_sheet_mm[:, 1]))
    span_px = float(np.ptp(seen.in_frame_px[:, 0]) + np.ptp(seen.in_frame_px[:, 1]))
    focal_px = track.size[0] / 2 / math.tan(math.radians(start["hfov_deg"]) / 2)
    away_mm = focal_px * span_mm / max(span_px, 1.0)
    off_px = float(seen.in_frame_px[:, 0].mean()) - track.size[0] / 2
    bearing = math.atan(off_px / focal_px) + math.radians(start["yaw_deg"])
    start["sheet_x_mm"], start["sheet_y_mm"] = away_mm * math.cos(bearing), away_mm * math.sin(bearing)
    return np.array([start[name] for name in NAMES])
