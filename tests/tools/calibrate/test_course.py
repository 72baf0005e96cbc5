"""The course in front of the marker sheet."""

import pytest

from behaviors.mission.robot import RobotTable
from nxtdrive.mission.assembly import open_robot
from nxtdrive.mission.body import build_rover
from nxtdrive.tools.calibrate.course import Course
from sim_backend.bundled import WORLDS


@pytest.mark.parametrize("stop_distance_mm", [1000.0, 900.0])
def test_an_obstacle_ends_the_drive_towards_the_sheet(stop_distance_mm):
    table = RobotTable(stop_distance_mm=stop_distance_mm)
    with open_robot("sim://calibration", "sim") as robot:
        course = Course(robot.brick, robot.camera, build_rover(robot.brick, table), table)
        driven_mm = course.straight(200.0, lambda _: False, 800.0)
    assert driven_mm == pytest.approx(1190.0 - stop_distance_mm, abs=60)


class _Reached(Exception):
    """The course has come to a part of it."""


def _drive_until(part, world):
    """Drive the course in a room until it says that a part begins."""

    def say(line):
        if line == part:
            raise _Reached

    table = RobotTable()
    with open_robot(f"sim://{world}", "sim") as robot:
        course = Course(robot.brick, robot.camera, build_rover(robot.brick, table), table)
        with pytest.raises(_Reached):
            course.drive_all(say)


@pytest.fixture(name="write_world")
def _write_world(tmp_path):
    def write(camera, start_x_mm=1900):
        world = tmp_path / "world.toml"
        text = (WORLDS / "calibration.toml").read_text().replace("start_mm = [1900,", f"start_mm = [{start_x_mm},")
        world.write_text(f"{text}\n[camera]\n{camera}\n")
        return world

    return write


def test_a_sheet_that_a_tilted_camera_never_sees_whole_from_near_leaves_its_view(write_world):
    _drive_until("driving towards it", write_world("tilt_deg = 17", start_x_mm=2550))


def test_the_drive_back_brings_a_sheet_into_view_that_is_not_whole_from_near(write_world):
    table, world = RobotTable(), write_world("tilt_deg = 17", start_x_mm=2550)
    with open_robot(f"sim://{world}", "sim") as robot:
        course = Course(robot.brick, robot.camera, build_rover(robot.brick, table), table)
        driven_mm = course.straight(-200.0, lambda _: False, 400.0)
    assert driven_mm == pytest.approx(400.0, abs=60)


def test_a_turn_ends_at_the_sheet_also_if_no_frame_shows_it_in_the_middle(write_world):
    _drive_until("driving towards it", write_world("fps = 2\nhfov_deg = 30"))
