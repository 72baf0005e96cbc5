"""The robot of a mission when its sensors fail, return, or are distrusted."""

import pytest

from behaviors.mission.robot import RobotTable
from behaviors.ports import SensorLost
from nxtdrive.mission.body import MissionBody, build_rover, lacking_sensors, safety_sensors
from nxtdrive.motion.drive_settings import DriveSettings
from nxtdrive.motion.rover import Rover
from sim_backend.devices import UltrasonicSensor

RETRIED_S = 11.0
STUCK = "It measures 100 mm wherever the robot turns."


class SonarOnly:
    """A robot with a sonar and no bumper.

    Attributes:
        body: The robot.
        received: What it has reported about its sensors, with whether there was an error.
    """

    def __init__(self, room):
        self.received = []
        self.body = MissionBody(Rover(room.brick.link, touch=None), ["sonar"])
        self.body.on_sensor_change(lambda sensor, error: self.received.append((sensor, bool(error))))
        self._room = room

    def fail(self):
        self._room.attach(4, None)
        for _ in range(3):
            self.body.range_mm()

    def recover(self):
        self._room.attach(4, UltrasonicSensor(lambda: 150))
        self._room.brick.sleep(RETRIED_S)
        assert self.body.range_mm() == 1500.0


@pytest.fixture
def robot(lab):
    return SonarOnly(lab())


def test_a_distrusted_sonar_that_fails_and_returns_is_still_distrusted(robot):
    robot.body.distrust_sonar(STUCK)
    robot.fail()
    robot.recover()
    with pytest.raises(SensorLost, match=STUCK):
        robot.body.drive(100, 0)
    assert robot.received == [("sonar", True)]
    robot.body.trust_sonar()
    assert robot.body.drive(100, 0) is None
    assert robot.received == [("sonar", True), ("sonar", False)]


def test_a_failed_sonar_that_is_trusted_again_is_still_failed(robot):
    robot.fail()
    robot.body.distrust_sonar(STUCK)
    robot.body.trust_sonar()
    with pytest.raises(SensorLost, match="sonar: "):
        robot.body.drive(100, 0)
    assert robot.received == [("sonar", True)]
    robot.recover()
    assert robot.body.drive(100, 0) is None
    assert robot.received == [("sonar", True), ("sonar", False)]


@pytest.mark.parametrize("described", [{"wheel_diameter_mm": 24.0}, {"axle_track_mm": 500.0}, {}])
def test_a_robot_with_small_wheels_or_a_wide_track_drives_as_fast_as_these_allow(lab, described):
    rover = build_rover(lab().brick, RobotTable(touch=0, ultrasonic=0, **described))
    assert rover.straight(100.0).distance_mm == pytest.approx(100.0, abs=5)
    assert rover.turn(90.0).turned_deg == pytest.approx(90.0, abs=5)
    assert (rover.settings == DriveSettings()) is (not described)


@pytest.mark.parametrize(
    ("ports", "has"), [((4, 1), ["sonar", "bumper"]), ((0, 1), ["bumper"]), ((4, 0), ["sonar"]), ((0, 0), [])]
)
def test_a_robot_has_each_sensor_of_the_safety_stop_or_lacks_it(ports, has):
    robot = RobotTable(ultrasonic=ports[0], touch=ports[1])
    assert safety_sensors(robot) == has
    assert lacking_sensors(robot) == [sensor for sensor in ("sonar", "bumper") if sensor not in has]
