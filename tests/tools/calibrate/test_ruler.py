"""Wheels that a person measures with a ruler."""

import datetime

import pytest

from behaviors.mission.robot import RobotFile, RobotTable
from nxtdrive.mission.assembly import open_robot
from nxtdrive.tools.calibrate.course import CalibrationRefused
from nxtdrive.tools.calibrate.ruler import calibrate_by_ruler
from sim_backend.firmware.motors.bench_motor import BenchMotor

TODAY = datetime.date(2026, 1, 2)


def _asked(question):
    pytest.fail(question)


def test_a_drive_that_an_obstacle_ends_is_not_measured():
    described = RobotFile(robot=RobotTable(stop_distance_mm=1000.0))
    with open_robot("sim://calibration", "sim") as robot, pytest.raises(CalibrationRefused, match="ended: obstacle"):
        calibrate_by_ruler(robot.brick, described, TODAY, lambda _: None, _asked)


def test_a_turn_in_which_a_wheel_is_held_is_not_measured():
    told = []

    def ready(text):
        told.append(text)
        if len(told) == 2:
            robot.brick.link.transport.simulation.brick.attach_motor("B", BenchMotor(locked=True))

    with open_robot("sim://open", "sim") as robot, pytest.raises(CalibrationRefused, match="turn was ended: stalled"):
        calibrate_by_ruler(robot.brick, RobotFile(robot=RobotTable()), TODAY, ready, lambda _: 1000.0)
