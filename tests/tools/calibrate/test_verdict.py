"""Refusals, and the robot file that is written."""

import datetime
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviors.mission.robot import (
    CalibrationTable,
    CameraTable,
    MeasuredTable,
    RobotFile,
    RobotTable,
    load_robot_file,
)
from nxtdrive.tools.calibrate.camera_and_wheels import NAMES, Estimate, believed_values
from nxtdrive.tools.calibrate.course import CalibrationRefused
from nxtdrive.tools.calibrate.least_squares import fit
from nxtdrive.tools.calibrate.sonar_place import estimate_sonar, size_doubt
from nxtdrive.tools.calibrate.track import Track
from nxtdrive.tools.calibrate.verdict import check, described, write_robot_file

GOOD = Estimate(dict.fromkeys(NAMES, 1.0), dict.fromkeys(NAMES, 0.001), 0.2, 200, converged=True)
finite = st.floats(-20, 20)


def test_the_track_of_a_robot_file_counts_with_the_slip_that_it_names():
    by_ruler, fitted = RobotTable(axle_track_mm=100.8, turn_slip_percent=10.0), RobotTable(axle_track_mm=112.0)
    assert believed_values(by_ruler, CameraTable()) == pytest.approx(believed_values(fitted, CameraTable()))


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (replace(GOOD, converged=False), "no values fit"),
        (replace(GOOD, residual_px=3.0), "miss the markers by 3.0 px"),
        (replace(GOOD, standard_errors={**GOOD.standard_errors, "hfov_deg": 3.0}), "hfov_deg is uncertain by 3"),
        (replace(GOOD, residual_px=math.nan), "miss the markers by nan px"),
        (replace(GOOD, standard_errors={**GOOD.standard_errors, "roll_deg": math.nan}), "roll_deg is uncertain by nan"),
    ],
)
def test_what_is_not_good_enough_is_refused(found, said):
    with pytest.raises(CalibrationRefused, match=said):
        check(found, 320, 1.0)


@pytest.mark.parametrize("missed_px", [8.3, math.nan])
def test_a_drive_in_which_the_robot_was_moved_is_refused(missed_px):
    with pytest.raises(CalibrationRefused, match="the robot was moved, or a wheel slipped"):
        check(GOOD, 320, missed_px)


def test_what_is_good_enough_is_not_refused():
    check(GOOD, 320, 1.0)


def test_a_value_that_no_robot_has_is_refused():
    with pytest.raises(CalibrationRefused, match=r"robot\.wheel_diameter_mm"):
        described(RobotFile(), {"robot": {"wheel_diameter_mm": 2.0}})


def test_values_that_were_not_measured_are_kept():
    before = RobotFile(robot=RobotTable(radius_mm=140.0, axle_track_mm=100.0), camera=CameraTable(tilt_deg=3.0))
    after = described(before, {"robot": {"axle_track_mm": 120.0}, "calibration": {"brick_name": "NXT"}})
    assert (after.robot.radius_mm, after.robot.axle_track_mm, after.camera.tilt_deg) == (140.0, 120.0, 3.0)
    assert after.robot.model_fields_set == {"radius_mm", "axle_track_mm"}


@settings(max_examples=25)
@given(
    roll=finite, mismatch=finite, name=st.text(max_size=15), error=st.floats(0, 1e-3), reversed_=st.booleans(),
    method=st.text(max_size=20), key=st.text(max_size=5),
)  # fmt: skip
def test_a_robot_file_is_read_as_it_was_written(tmp_path_factory, roll, mismatch, name, error, reversed_, method, key):
    path = tmp_path_factory.getbasetemp() / "robot.toml"
    camera = MeasuredTable(
        date=datetime.date(2026, 1, 2), method=method, standard_uncertainty={"roll_deg": error, key: error}, measured={}
    )
    file = RobotFile(
        robot=RobotTable(left="A", left_reversed=reversed_, wheel_mismatch_percent=mismatch),
        camera=CameraTable(roll_deg=roll),
        calibration=CalibrationTable(brick_name=name, camera=camera),
    )
    write_robot_file(path, file)
    assert load_robot_file(path) == file


def test_a_line_is_fitted_in_spite_of_outliers():
    rng = np.random.default_rng(1)
    x = np.linspace(0, 10, 200)
    y = 3 * x + 2 + rng.normal(0, 0.1, x.size)
    y[::20] += 50
    found = fit(lambda p: p[0] * x + p[1] - y, np.zeros(2), np.full(2, 100.0), np.full(2, 1e-4))
    assert found.converged
    for value, error, true in zip(found.values, found.standard_errors, (3, 2), strict=True):
        assert abs(value - true) < max(5 * error, 0.05)


def _towards_the_wall(turn_deg=0.0):
    """Return a straight drive of 0.3 m, what is known of it, and how far from the wall it was each time."""
    values = {"wheel_mismatch_percent": 0.0, "wheel_diameter_mm": 56.0, "axle_track_mm": 112.0}
    values |= {"sheet_x_mm": 1300.0, "sheet_y_mm": 0.0, "sheet_turn_deg": turn_deg}
    mm_per_deg, track = math.pi * 56 / 360, Track((640, 480))
    track.counts = [(i * 0.1, i * 10.0, i * 10.0) for i in range(60)]
    return track, values, [(1300.0 - i * 10.0 * mm_per_deg) * math.cos(math.radians(turn_deg)) for i in range(60)]


@given(st.floats(-50, 200), st.floats(-5, 5))
def test_the_place_of_the_sonar_is_found(forward_mm, turn_deg):
    track, values, walls_mm = _towards_the_wall(turn_deg)
    ahead_mm = forward_mm * math.cos(math.radians(turn_deg))
    track.ranges = [(i * 0.1, wall_mm - ahead_mm) for i, wall_mm in enumerate(walls_mm)]
    found = estimate_sonar(track, values)
    assert found.forward_mm == pytest.approx(forward_mm, abs=0.5)


def test_whole_centimetres_are_part_of_the_uncertainty():
    track, values, walls_mm = _towards_the_wall()
    track.ranges = [(i * 0.1, (wall_mm - 100.0) // 10 * 10) for i, wall_mm in enumerate(walls_mm)]
    found = estimate_sonar(track, values)
    assert abs(found.forward_mm - 100.0) < 2 * found.standard_error_mm
    assert found.standard_error_mm == pytest.approx(10 / math.sqrt(12), rel=0.1)


@pytest.mark.parametrize(
    ("echoes", "said"), [(0, "gave 0 echoes"), (19, "gave 19 echoes with the wall straight ahead"), (60, "scatter by")]
)
def test_a_sonar_that_is_silent_or_stuck_is_refused(echoes, said):
    track, values, _ = _towards_the_wall()
    track.ranges = [(i * 0.1, 400.0) for i in range(echoes)]
    with pytest.raises(CalibrationRefused, match=said):
        estimate_sonar(track, values)


@pytest.mark.parametrize(("printed", "doubted"), [(1.0, False), (0.98, False), (0.94, True), (1.06, True)])
def test_a_sheet_of_another_size_is_doubted_by_the_distances_of_the_sonar(printed, doubted):
    rng = np.random.default_rng(1)
    track, values, walls_mm = _towards_the_wall()
    # distances that follow from the sheet are too large if it was printed too small
    track.ranges = [(i * 0.1, printed * (mm - 100.0) + rng.normal(0, 5)) for i, mm in enumerate(walls_mm)]
    track.ranges[10] = (1.0, 300.0)
    found = estimate_sonar(track, values)
    assert found.scale == pytest.approx(printed, abs=0.015)
    assert (f"the sonar measures {found.scale:.0%} of the distances" in size_doubt(found.scale)) == doubted


def test_a_sheet_of_half_the_size_is_no_fault_of_the_sonar():
    track, values, walls_mm = _towards_the_wall()
    track.ranges = [(i * 0.1, 0.5 * (mm - 100.0)) for i, mm in enumerate(walls_mm)]
    with pytest.raises(CalibrationRefused, match=r"measures 50% of the distances .* print it at 100 %"):
        estimate_sonar(track, values)


@pytest.mark.parametrize("cone_deg", [10.0, 30.0, 44.0])
@pytest.mark.parametrize("aslant", [True, False])
def test_the_beam_of_the_sonar_is_found_where_the_wall_echoes_aslant(cone_deg, aslant):
    rng = np.random.default_rng(1)
    track, (_, values, _) = Track((640, 480)), _towards_the_wall()
    for i in range(-400, 401):
        off_deg = i * 0.15
        counts = math.radians(off_deg - -60.0) * 112 / 2 / (math.pi * 56 / 360)
        track.counts.append(((i + 400) * 0.1, counts, -counts))
        beyond_deg = max(0.0, abs(off_deg) - cone_deg / 2)
        if aslant or not beyond_deg:
            upright_mm = 1300.0 - 100.0 * math.cos(math.radians(off_deg))
            range_mm = upright_mm / math.cos(math.radians(beyond_deg)) + rng.normal(0, 5)
            track.ranges.append(((i + 400) * 0.1, range_mm))
    found = estimate_sonar(
        track, values | {"sheet_turn_deg": 60.0, "sheet_x_mm": 650.0, "sheet_y_mm": 1300 * math.sin(math.radians(60))}
    )
    assert found.forward_mm == pytest.approx(100.0, abs=3)
    if aslant:
        assert found.cone_deg[0] == pytest.approx(cone_deg, abs=3)
        assert 3.0 <= found.cone_deg[1] < 5.0
        assert found.noise_mm == pytest.approx(5.0, rel=0.3)
    else:
        assert found.cone_deg is None
