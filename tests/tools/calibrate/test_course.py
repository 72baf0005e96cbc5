"""The course in front of the marker sheet."""

import pytest

from behaviors.mission.robot import RobotTable
from nxtdrive.mission.assembly import open_robot
from nxtdrive.mission.body import build_rover
from nxtdrive.tools.calibrate.course import Course


@pytest.mark.parametrize("stop_distance_mm", [1000.0, 900.0])
def test_an_obstacle_ends_the_drive_towards_the_sheet(stop_distance_mm):
    table = RobotTable(stop_distance_mm=stop_distance_mm)
    with open_robot("sim://calibration", "sim") as robot:
        course = Course(robot.brick, robot.camera, build_rover(robot.brick, table), table)
        driven_mm = course.straight(200.0, lambda _: False, 800.0)
    assert driven_mm == pytest.approx(1190.0 - stop_distance_mm, abs=60)
