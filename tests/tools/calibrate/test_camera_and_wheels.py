"""The estimators, on recordings that were computed from known values."""

import numpy as np
import pytest

from behaviors.mission.robot import CameraTable, RobotTable
from nxtdrive.tools.calibrate.camera_and_wheels import NAMES, Corners, estimate
from nxtdrive.tools.calibrate.course import CalibrationRefused
from nxtdrive.tools.calibrate.sheet import MARKER_MM, Seen, marker_centres
from nxtdrive.tools.calibrate.track import Track, View

TRUE = {
    "hfov_deg": 66.0,
    "yaw_deg": 9.0,
    "tilt_deg": -6.0,
    "roll_deg": 11.0,
    "forward_mm": 60.0,
    "right_mm": -15.0,
    "latency_s": 0.22,
    "wheel_diameter_mm": 59.0,
    "wheel_mismatch_percent": 0.6,
    "axle_track_mm": 104.0,
    "sheet_x_mm": 1150.0,
    "sheet_y_mm": 60.0,
    "above_mm": 10.0,
    "sheet_turn_deg": 4.0,
    "sheet_roll_deg": 0.7,
    "sheet_lean_deg": 0.5,
    "blur_px": 0.1,
}


def _corners():
    half = MARKER_MM / 2
    return np.array(
        [
            (x + a * half, y + b * half)
            for x, y in marker_centres().values()
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
    )


def _recorded(true, noise_px=0.1, seed=1):
    """Return the track of a robot that looks to both sides, drives forward and back, and turns full circles."""
    rng = np.random.default_rng(seed)
    legs = [(0, 20, 1), (0, -20, 2), (0, 20, 1), (100, 0, 5), (0, 20, 1), (0, -20, 2), (0, 20, 1), (-100, 0, 6)]
    settled_s = sum(seconds for *_, seconds in legs)
    legs += [(0, 45, 8), (0, -45, 8), (0, 20, 1), (0, -20, 2), (0, 20, 1)]
    counts, time_s, left, right = [(0.0, 0.0, 0.0)], 0.0, 0.0, 0.0
    mm, track_mm = np.pi * 56 / 360, 112.0  # it drives by what it believes
    for speed, rate, seconds in legs:
        for _ in range(round(seconds / 0.05)):
            sideways = np.radians(rate) * track_mm / 2
            left, right, time_s = (
                left + (speed + sideways) / mm * 0.05,
                right + (speed - sideways) / mm * 0.05,
                time_s + 0.05,
            )
            counts.append((time_s, round(left), round(right)))
    times = np.arange(0.6, time_s, 0.1)
    track, points = Track((640, 480), counts), _corners()
    track.views = [View(t, Seen(points, np.zeros_like(points))) for t in times]
    u, v = Corners(track, len(times)).predict(true, np.zeros(Corners(track, 1).slips))
    u, v = u.reshape(len(times), -1), v.reshape(len(times), -1)
    track.views = []
    for t, columns, rows in zip(times, u, v, strict=True):
        inside = (columns > 0) & (columns < 640) & (rows > 0) & (rows < 480)
        inside = np.repeat(inside.reshape(-1, 4).all(axis=1), 4)  # a marker is seen as a whole or not at all
        if inside.sum() >= 4 and np.ptp(columns) > 60:
            pixels = np.stack([columns, rows], axis=1)[inside]
            track.views.append(View(t, Seen(points[inside], pixels + rng.normal(0, noise_px, pixels.shape))))
    return track, settled_s


@pytest.mark.parametrize(
    ("views", "settled_s", "said"),
    [
        (0, None, "the sheet was seen in none of the frames"),
        (80, 0.5, "the sheet was seen in none of the frames"),
        (80, None, "of 80 frames that show the sheet, 0 were taken in steady motion; 60 are needed"),
    ],
)
def test_a_sheet_that_was_hardly_seen_in_steady_motion_is_refused(views, settled_s, said):
    """As with motors that do not report their turning."""
    points = _corners()
    track = Track((640, 480), [(i * 0.02, 0.0, 0.0) for i in range(400)])
    track.views = [View(1.0 + i * 0.1, Seen(points, points * 0.5 + (320, 240))) for i in range(views)]
    with pytest.raises(CalibrationRefused, match=said):
        estimate(track, RobotTable(), CameraTable(), settled_s)


@pytest.mark.slow
def test_known_values_are_found():
    track, settled_s = _recorded(TRUE)
    found = estimate(track, RobotTable(), CameraTable(), settled_s)
    assert found.converged
    assert found.residual_px == pytest.approx(0.15, abs=0.15)
    for name in NAMES[:10]:
        error = abs(found.values[name] - TRUE[name])
        assert error < max(6 * found.standard_errors[name], 1e-3 * abs(TRUE[name])), (name, found.values[name])
    assert found.standard_errors["hfov_deg"] < 0.5
