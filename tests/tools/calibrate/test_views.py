"""The parts of the estimate: where the sheet is expected in a frame, the path by the counts, and steady motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nxtdrive.motion.odometry import Odometry
from nxtdrive.motion.outputs import Sample
from nxtdrive.motion.wheel_geometry import WheelGeometry
from nxtdrive.tools.calibrate.camera_and_wheels import NAMES, Corners
from nxtdrive.tools.calibrate.least_squares import fit
from nxtdrive.tools.calibrate.sheet import Seen
from nxtdrive.tools.calibrate.track import Track, View, at_times, poses, smoothed
from nxtdrive.vision.geometry import Mounting, Pinhole

WIDTH, HEIGHT = 640, 480
FOCAL_PX = 320 / math.tan(math.radians(30))
MARKER_MM = np.array([(-60.0, -50.0), (40.0, -50.0), (40.0, 50.0), (-60.0, 50.0)])
"""Corners on the sheet, right of its middle and below it."""
PLAIN = dict.fromkeys(NAMES, 0.0) | {
    "hfov_deg": 60.0,
    "wheel_diameter_mm": 56.0,
    "axle_track_mm": 112.0,
    "sheet_x_mm": 1000.0,
}


def expected_px(on_sheet_mm=MARKER_MM, counts=((0.0, 0.0, 0.0), (10.0, 0.0, 0.0)), time_s=5.0, **parameters):
    """Return columns and rows where the model expects corners; the robot stands at the start by default."""
    track = Track((WIDTH, HEIGHT), list(counts), [View(time_s, Seen(on_sheet_mm, on_sheet_mm))])
    corners = Corners(track, 1)
    return corners.predict(PLAIN | parameters, np.zeros(corners.slips))


ANGLES = st.floats(-20, 20)


@settings(max_examples=20)
@given(
    hfov=st.floats(40, 90), yaw=ANGLES, tilt=ANGLES, roll=ANGLES, forward=st.floats(-50, 100), right=st.floats(-50, 50),
    above=st.floats(-100, 100), sheet_x=st.floats(800, 1500), sheet_y=st.floats(-100, 100),
)  # fmt: skip
def test_corners_are_expected_where_the_camera_of_a_mission_sees_their_place(
    hfov, yaw, tilt, roll, forward, right, above, sheet_x, sheet_y
):
    u, v = expected_px(
        hfov_deg=hfov, yaw_deg=yaw, tilt_deg=tilt, roll_deg=roll, forward_mm=forward, right_mm=right, above_mm=above,
        sheet_x_mm=sheet_x, sheet_y_mm=sheet_y,
    )  # fmt: skip
    camera = Pinhole.from_hfov(WIDTH, hfov, Mounting(yaw, tilt, roll)).resized(WIDTH, HEIGHT)
    bearings_deg, below_deg = camera.directions(u, v)
    x, y, down = sheet_x - forward, sheet_y - right + MARKER_MM[:, 0], above + MARKER_MM[:, 1]
    assert bearings_deg == pytest.approx(np.degrees(np.arctan2(y, x)), abs=1e-6)
    assert below_deg == pytest.approx(np.degrees(np.arctan2(down, np.hypot(x, y))), abs=1e-6)


@pytest.mark.parametrize(
    ("parameter", "on_sheet_mm", "place_mm"),
    [
        ("sheet_turn_deg", (100, 0), (950.0, 86.6, 0.0)),  # its right edge comes nearer
        ("sheet_turn_deg", (0, 100), (1000.0, 0.0, 100.0)),
        ("sheet_roll_deg", (100, 0), (1000.0, 86.6, 50.0)),  # its right edge sinks
        ("sheet_roll_deg", (0, 100), (1000.0, -50.0, 86.6)),
        ("sheet_lean_deg", (0, -100), (950.0, 0.0, -86.6)),  # its upper edge comes nearer
        ("sheet_lean_deg", (100, 0), (1000.0, 100.0, 0.0)),
    ],
)
def test_the_sheet_turns_rolls_and_leans_as_its_parameters_say(parameter, on_sheet_mm, place_mm):
    u, v = expected_px(np.array([on_sheet_mm] * 4, float), **{parameter: 30.0})
    x, y, down = place_mm
    assert (u[0], v[0]) == pytest.approx((WIDTH / 2 + FOCAL_PX * y / x, HEIGHT / 2 + FOCAL_PX * down / x), abs=0.05)


def test_a_leaning_sheet_that_is_turned_leans_the_way_it_faces():
    u, v = expected_px(np.array([(0.0, -100.0)] * 4), sheet_turn_deg=90.0, sheet_lean_deg=30.0)
    assert (u[0], v[0]) == pytest.approx((WIDTH / 2 - FOCAL_PX * 0.05, HEIGHT / 2 - FOCAL_PX * 0.0866), abs=0.05)


def test_blur_moves_each_corner_towards_the_middle_of_its_marker():
    sharp, blurred = (np.stack(expected_px(blur_px=by)) for by in (0.0, 0.5))
    assert blurred - sharp == pytest.approx(np.array([(0.5, -0.5, -0.5, 0.5), (0.5, 0.5, -0.5, -0.5)]), abs=1e-9)


@pytest.mark.parametrize("latency_s", [0.0, 2.0])
def test_a_frame_shows_the_sheet_from_where_the_robot_was_when_it_was_exposed(latency_s):
    """It turns to the right by 2 degrees a second, so the sheet moves to the left."""
    per_s = 2.0 * 112 / 56
    counts = [(i / 10, i / 10 * per_s, -i / 10 * per_s) for i in range(101)]
    u, _ = expected_px(np.zeros((4, 2)), counts, latency_s=latency_s)
    assert u[0] == pytest.approx(WIDTH / 2 - FOCAL_PX * math.tan(math.radians(2.0 * (5.0 - latency_s))), abs=0.01)


@settings(max_examples=20)
@given(st.lists(st.tuples(st.integers(-50, 50), st.integers(-50, 50)), min_size=1, max_size=30), st.floats(-10, 10))
def test_the_path_by_the_counts_is_that_of_odometry(steps, mismatch_percent):
    wheels = WheelGeometry.of(56.0, 112.0, reversed=False, mismatch_percent=mismatch_percent)
    counts = np.cumsum([(1000.0, 2000.0), *steps], axis=0)
    odometry = Odometry(wheels)
    for i, (left, right) in enumerate(counts):
        odometry.update(Sample((left, right), i * 0.5, 0.0, None))
    path = poses(np.column_stack([np.arange(len(counts)) * 0.5, counts]), wheels.mm_per_deg, wheels.track_mm)
    pose = odometry.pose
    assert path[-1] == pytest.approx((0.5 * len(steps), pose.x_mm, pose.y_mm, math.radians(pose.heading_deg)))


def test_slip_is_a_turn_that_the_counts_do_not_show():
    counts = np.array([(0.0, 0.0, 0.0), (1.0, 90.0, 90.0), (2.0, 180.0, 180.0)])
    path = poses(counts, (1.0, 1.0), 100.0, np.array([0.0, 0.2]))
    assert path[:, 3] == pytest.approx([0.0, 0.0, 0.2])
    assert path[-1, 1:3] == pytest.approx([90 + 90 * math.cos(0.1), 90 * math.sin(0.1)])


def test_places_between_counts_are_interpolated():
    path = np.array([(0.0, 0.0, 10.0, 0.0), (2.0, 100.0, 20.0, 1.0)])
    assert [each[0] for each in at_times(path, np.array([0.5]))] == pytest.approx([25.0, 12.5, 0.25])


def test_counts_are_averaged_over_a_fifth_of_a_second():
    times = np.arange(0, 200) / 100
    jump = np.where(times >= 1.0, 10.0, 0.0)
    found = smoothed(np.column_stack([times, jump, 50 - 3 * times]))
    assert found[:, 0] == pytest.approx(times)
    assert found[[85, 95, 100, 105, 115], 1] == pytest.approx([0.0, 2.75, 5.25, 7.75, 10.0], abs=0.3)
    assert found[:, 2] == pytest.approx(50 - 3 * times), "steady motion stays, also at the ends"


def _moving(speed_deg_s, until_s=10.0):
    """Return a track of counts, 50 a second, and a view every tenth of a second."""
    track, angle = Track((WIDTH, HEIGHT)), 0.0
    for i in range(round(until_s * 50)):
        track.counts.append((i / 50, angle, -angle))
        angle += speed_deg_s(i / 50) / 50
    track.views = [View(i / 10, Seen(MARKER_MM, MARKER_MM)) for i in range(round(until_s * 10))]
    return track


@pytest.mark.parametrize("latency_s", [0.0, 0.5])
@pytest.mark.parametrize("speed_deg_s", [40.0, -40.0])
def test_only_views_from_steady_motion_are_used(latency_s, speed_deg_s):
    """The wheels turn from 3 to 6 s."""
    track = _moving(lambda time_s: speed_deg_s if 3.0 <= time_s < 6.0 else 0.0)
    used = [view.time_s - latency_s for view in track.steady(latency_s).views]
    assert used[0] == pytest.approx(3.2, abs=0.11)
    assert used[-1] == pytest.approx(5.8, abs=0.11)
    assert len(used) >= 24


def test_views_from_motion_that_gets_faster_are_not_used():
    assert _moving(lambda time_s: 16**time_s, 2.5).steady(0.0).views == []


def test_views_before_the_first_count_and_after_the_last_are_not_used():
    track = _moving(lambda _: 40.0)
    used = [view.time_s - 1.0 for view in track.steady(1.0).views]
    assert used[0] == pytest.approx(0.3, abs=0.1)
    track.counts = track.counts[:250]
    assert track.steady(0.0).views[-1].time_s == pytest.approx(4.7, abs=0.1)


def test_a_recording_up_to_a_time_has_all_that_came_until_then():
    track = _moving(lambda _: 40.0)
    track.ranges = [(1.0, 500.0), (2.0, 400.0), (3.0, 300.0)]
    part = track.until(2.0)
    assert (part.size, part.ranges) == (track.size, track.ranges[:2])
    assert (part.counts[-1][0], part.views[-1].time_s) == (2.0, 2.0)


@pytest.mark.parametrize("alike", [1, 4])
def test_the_standard_error_is_that_of_the_mean_of_independent_measurements(alike):
    measured = np.random.default_rng(1).normal(7.0, 2.0, 400)
    found = fit(lambda p: np.repeat(p[0] - measured, alike), np.zeros(1), np.full(1, 1e6), np.full(1, 1e-3), alike)
    assert found.converged
    assert found.residual == pytest.approx(2.0, abs=0.2)
    assert found.standard_errors[0] == pytest.approx(2.0 / math.sqrt(400), rel=0.25)
    assert found.values[0] == pytest.approx(7.0, abs=3 * found.standard_errors[0])


def test_a_value_that_nothing_was_measured_of_keeps_its_guess_and_its_uncertainty():
    measured = np.random.default_rng(1).normal(7.0, 2.0, 100)
    found = fit(lambda p: p[0] - measured, np.array([0.0, 5.0]), np.array([1e6, 0.25]), np.full(2, 1e-3))
    assert found.values[1] == pytest.approx(5.0)
    assert found.standard_errors[1] == pytest.approx(0.25)


def test_a_guess_weighs_as_much_as_measurements_of_its_uncertainty():
    measured = 7.0 + np.random.default_rng(1).normal(0.0, 5.0, 2500)
    found = fit(lambda p: p[0] - measured, np.array([7.3]), np.full(1, 0.1), np.full(1, 1e-3))
    assert found.values[0] == pytest.approx((measured.mean() + 7.3) / 2, abs=0.03)
    assert found.standard_errors[0] == pytest.approx(0.1 / math.sqrt(2), rel=0.15)


def test_a_fit_that_takes_several_steps_ends_where_guess_and_measurements_are_missed_least():
    measured = math.exp(1.5) + np.random.default_rng(1).normal(0.0, 0.5, 400)
    guess, sd = 1.2, 0.02
    found = fit(lambda p: np.exp(p[0]) - measured, np.array([guess]), np.array([sd]), np.array([1e-4]))
    values = np.linspace(1.2, 1.6, 2001)
    missed = ((np.exp(values)[:, None] - measured) ** 2).sum(axis=1) / found.residual**2 + ((values - guess) / sd) ** 2
    assert found.converged
    assert found.values[0] == pytest.approx(values[missed.argmin()], abs=0.003)
