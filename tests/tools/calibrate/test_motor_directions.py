"""Which way the motors drive, and the power from which on they turn."""

import pytest

from behaviors.mission.robot import RobotTable
from nxtdrive.brick import open_brick
from nxtdrive.tools.calibrate.course import CalibrationRefused
from nxtdrive.tools.calibrate.motor_directions import dead_zone_percent, is_reversed
from sim_backend.firmware.motors.bench_motor import BenchMotor


@pytest.fixture(name="brick")
def _brick():
    with open_brick("sim://open") as brick:
        yield brick


def _simulation(brick):
    return brick.link.transport.simulation


@pytest.mark.parametrize(("port", "sign", "backwards"), [("B", 1, False), ("C", -1, False), ("B", -1, True)])
def test_a_wheel_that_turns_the_picture_the_other_way_is_reversed_and_turned_back(brick, port, sign, backwards):
    def column():
        return 0.3 - _simulation(brick).truth.pose.heading_deg / 60

    before_deg = _simulation(brick).truth.pose.heading_deg
    assert is_reversed(brick, port, sign, column) == backwards
    assert _simulation(brick).truth.pose.heading_deg == pytest.approx(before_deg, abs=2.0)


def test_a_motor_that_does_not_move_the_picture_is_refused(brick):
    with pytest.raises(CalibrationRefused, match="port A"):
        is_reversed(brick, "A", 1, lambda: 0.3)


def test_the_least_power_is_found_on_the_spot_and_the_wheels_rest_afterwards(brick):
    before = _simulation(brick).truth.pose
    assert dead_zone_percent(brick, RobotTable()) == 8
    brick.sleep(0.3)
    after = _simulation(brick).truth.pose
    assert (after.x_mm, after.y_mm) == pytest.approx((before.x_mm, before.y_mm), abs=1.0)
    brick.sleep(1.0)
    assert _simulation(brick).truth.pose == after


def test_a_wheel_that_never_turns_is_refused_with_the_other_one_at_rest(brick):
    _simulation(brick).brick.attach_motor("B", BenchMotor(locked=True))
    with pytest.raises(CalibrationRefused, match="do not turn at 40 %"):
        dead_zone_percent(brick, RobotTable())
    brick.sleep(0.5)
    before = brick.motor("C").angle
    brick.sleep(1.0)
    assert brick.motor("C").angle == before
