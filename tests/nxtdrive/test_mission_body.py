"""The robot of a mission when its sensors fail, return, or are distrusted."""

import pytest

from behaviors.mission.robot import RobotTable
from behaviors.ports import SensorLost, StopReason
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


BOX_AHEAD = '[[boxes]]\nname = "box"\nat_mm = [1600, 1500]\nsize_mm = [200, 1000]\nheight_mm = 300\n'
HELD = {"sonar": lambda body: body.distrust_sonar(STUCK), "neither": lambda body: None}


@pytest.mark.parametrize("forward", [lambda body: body.straight(5), lambda body: body.drive(0.5, 0)])
def test_a_robot_that_has_lost_its_only_safety_sensor_does_not_drive_forward(robot, lab, forward):
    robot.fail()
    with pytest.raises(SensorLost, match="sonar: "):
        forward(robot.body)
    assert not robot.body.can_drive_forward()


def test_a_robot_that_has_lost_its_only_safety_sensor_may_turn_and_drive_back(robot):
    robot.fail()
    assert robot.body.turn(20).done
    assert robot.body.straight(-50).done
    for motion in ((0, 30), (-50, 0)):
        assert robot.body.drive(*motion) is None
    robot.body.stop()


@pytest.mark.parametrize(("lost", "speed_mm_s"), [("sonar", 100), ("neither", 200)])
def test_without_one_of_two_safety_sensors_the_robot_drives_at_half_its_speed(lab, lost, speed_mm_s):
    room = lab("touch_port = 1\n")
    body = MissionBody(Rover(room.brick.link), ["sonar", "bumper"])
    HELD[lost](body)
    begun_s = room.brick.now()
    body.straight(200)
    straight_s = room.brick.now() - begun_s
    for _ in range(8):
        body.drive(200, 0)
        room.brick.sleep(0.1)
    assert room.simulation.truth.speed_mm_s == pytest.approx(speed_mm_s, rel=0.1)
    least_s = 200 / (DriveSettings().speed_mm_s * speed_mm_s / 200)
    assert least_s < straight_s < least_s + 1.5
    body.stop()
    room.brick.sleep(0.5)
    assert room.simulation.truth.speed_mm_s == 0


def test_a_robot_without_safety_sensors_drives_at_its_speed(lab):
    room = lab()
    body = MissionBody(Rover(room.brick.link, ultrasonic=None, touch=None), [])
    body.distrust_sonar(STUCK)
    for _ in range(8):
        body.drive(200, 0)
        room.brick.sleep(0.1)
    assert room.simulation.truth.speed_mm_s == pytest.approx(200, rel=0.1)


def test_a_distrusted_sonar_stops_the_robot_only_when_it_is_trusted_again(lab):
    room = lab("touch_port = 1\n" + BOX_AHEAD)
    body = MissionBody(Rover(room.brick.link), ["sonar", "bumper"])
    body.distrust_sonar(STUCK)
    assert body.straight(600).stop is StopReason.CONTACT
    body.straight(-150)
    body.trust_sonar()
    assert body.straight(600).stop is StopReason.OBSTACLE


def test_a_described_bumper_stops_the_robot(lab):
    rover = build_rover(lab("touch_port = 1\n" + BOX_AHEAD).brick, RobotTable(ultrasonic=0, touch=1))
    body = MissionBody(rover, ["bumper"])
    assert body.straight(600).stop is StopReason.CONTACT
    assert body.touching()


def test_turns_can_be_corrected(lab):
    body = MissionBody(Rover(lab().brick.link), ["sonar"])
    body.turn(90)
    body.correct_turns(1.1, 90.0)
    assert body.pose().heading_deg == pytest.approx(99, abs=3)


def test_the_pose_can_be_corrected(lab):
    body = MissionBody(Rover(lab().brick.link), ["sonar"])
    body.correct_pose(90.0, 0.0)
    body.correct_pose(0.0, -50.0)
    pose = body.pose()
    assert (pose.x_mm, pose.y_mm, pose.heading_deg) == pytest.approx((0.0, -50.0, 90.0))


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
