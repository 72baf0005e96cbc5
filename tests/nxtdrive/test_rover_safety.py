"""The safety stop's limits, and the motors after an error of `Rover.drive`."""

import math
from itertools import count

import pytest

from behaviors.ports import StopReason
from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import BrickError, LinkTimeout, LocalProtocolError
from nxtdrive.brick import Brick
from nxtdrive.motion.rover import DriveSettings, Rover, SafetyLimits
from nxtdrive.motion.sensor_health import SensorHealth
from nxtdrive.sensors import Touch, Ultrasonic
from nxtdrive.sensors.port import SensorTimeout
from sim_backend.devices import UltrasonicSensor

BOX_AHEAD = '[[boxes]]\nname = "box"\nat_mm = [2000, 1500]\nsize_mm = [200, 1000]\nheight_mm = 300\n'


@pytest.mark.parametrize("distance_mm", [math.nan, math.inf, -1, 2551, "200", None, True])
def test_a_stop_distance_that_would_not_stop_the_robot_is_refused(distance_mm):
    with pytest.raises(LocalProtocolError, match="stop_distance_mm must be"):
        SafetyLimits(stop_distance_mm=distance_mm)


@pytest.mark.parametrize("distance_mm", [0, 30.5, 2550])
def test_any_distance_that_the_sonar_measures_may_be_the_stop_distance(distance_mm):
    assert SafetyLimits(stop_distance_mm=distance_mm).stop_distance_mm == distance_mm


@pytest.mark.parametrize("motion", ["straight", "drive"])
def test_without_the_use_of_the_sonar_only_the_bumper_stops_the_robot(lab, motion):
    room = lab("touch_port = 1\n" + BOX_AHEAD)
    rover = room.brick.rover()

    def go_on():
        if motion == "straight":
            return rover.straight(1500).stop
        while (stop := rover.drive(200, 0)) is None:
            room.brick.sleep(0.1)
        return stop

    assert go_on() is StopReason.OBSTACLE
    rover.use_sonar(use=False)
    assert go_on() is StopReason.CONTACT
    rover.straight(-150)
    rover.use_sonar(use=True)
    assert go_on() is StopReason.OBSTACLE


@pytest.mark.parametrize(("speed_mm_s", "turn_deg_s"), [(-100, 0), (0, 30)])
def test_in_front_of_an_obstacle_the_robot_may_turn_and_drive_back(lab, speed_mm_s, turn_deg_s):
    room = lab(BOX_AHEAD)
    rover = room.brick.rover()
    assert rover.straight(1500).stop is StopReason.OBSTACLE
    for _ in range(10):
        assert rover.drive(speed_mm_s, turn_deg_s) is None
        room.brick.sleep(0.1)


def test_a_sensor_that_fails_three_times_in_a_row_is_left_out_and_retried_every_ten_seconds(lab):
    brick = lab().brick
    health, heard, calls = SensorHealth("sonar", brick.link), [], []
    health.listener = lambda name, error: heard.append((name, bool(error)))
    answers = True

    def measure():
        calls.append(brick.now())
        if not answers:
            raise SensorTimeout("no answer.")
        return 500

    def read_for(duration_s):
        calls.clear()
        end = brick.now() + duration_s
        values = set()
        while brick.now() < end:
            values.add(health.read(measure, None))
            brick.sleep(0.5)
        return values, len(calls)

    for answers in (True, False, False) * 2:
        assert health.read(measure, None) == (500 if answers else None)
    assert (health.lost, heard) == (False, [])
    assert read_for(9.5) == ({None}, 1)
    assert (health.lost, heard) == (True, [("sonar", True)])
    assert read_for(10) == ({None}, 1)
    answers = True
    brick.sleep(10)
    assert read_for(2) == ({500}, 4)
    assert (health.lost, heard) == (False, [("sonar", True), ("sonar", False)])


def listening(room):
    """A rover that leaves out sensors that fail, and what it has said of them."""
    rover, heard = room.brick.rover(), []
    rover.on_sensor_change(lambda sensor, error: heard.append((sensor, bool(error))))
    return rover, heard


def test_the_last_echo_of_a_sonar_that_has_failed_is_forgotten(lab):
    room = lab()
    room.attach(4, UltrasonicSensor(lambda: 15))
    rover, _ = listening(room)
    assert rover.straight(100).stop is StopReason.OBSTACLE
    room.attach(4, None)
    for _ in range(3):
        assert rover.range_mm() is None
    room.brick.sleep(2)
    assert rover.straight(100).stop is StopReason.DONE


def test_an_obstacle_that_has_come_since_the_last_motion_keeps_the_robot_from_starting(lab):
    room = lab(latency_ms=150)
    way_cm = [200]
    room.attach(4, UltrasonicSensor(lambda: way_cm[0]))
    rover = room.brick.rover()
    assert rover.straight(100).stop is StopReason.DONE
    way_cm[0] = 15
    room.brick.sleep(0.5)
    result = rover.straight(100)
    assert (result.stop, result.distance_mm) == (StopReason.OBSTACLE, 0.0)


def test_a_range_is_not_one_that_the_last_motion_left(lab):
    room = lab()
    way_cm = [200]
    room.attach(4, UltrasonicSensor(lambda: way_cm[0]))
    rover = room.brick.rover()
    assert rover.straight(100).stop is StopReason.DONE
    way_cm[0] = 50
    room.brick.sleep(2)
    assert rover.range_mm() == 500


def test_a_robot_on_the_way_brakes_if_its_next_motion_may_not_begin(lab):
    room = lab()
    way_cm = [200]
    room.attach(4, UltrasonicSensor(lambda: way_cm[0]))
    rover = room.brick.rover(settings=DriveSettings(lease_s=5.0))
    rover.drive(200, 0)
    room.brick.sleep(1)
    way_cm[0] = 15
    assert rover.straight(500).stop is StopReason.OBSTACLE
    refused_mm = room.simulation.truth.pose.x_mm
    room.brick.sleep(1)
    assert room.simulation.truth.pose.x_mm - refused_mm < 30


def test_a_bumper_that_has_failed_is_not_pressed(lab, mocker):
    room = lab("touch_port = 1\n")
    rover, heard = listening(room)
    mocker.patch.object(Touch, "pressed", mocker.PropertyMock(side_effect=SensorTimeout("no answer.")))
    for _ in range(3):
        assert rover.touching() is False
    assert heard == [("bumper", True)]
    assert rover.straight(100).stop is StopReason.DONE


@pytest.mark.parametrize("listens", [True, False])
def test_a_sonar_that_fails_now_and_then_is_neither_left_out_nor_an_error(lab, mocker, listens):
    room = lab()
    rover, heard = listening(room) if listens else (room.brick.rover(), [])
    poll, calls = Ultrasonic.poll, count(1)

    def fail_sometimes(sonar):
        if next(calls) % 5 == 0:
            raise SensorTimeout("no answer.")
        return poll(sonar)

    mocker.patch.object(Ultrasonic, "poll", fail_sometimes)
    assert rover.straight(1000).stop is StopReason.DONE
    assert next(calls) > 20
    assert heard == []


def test_a_sonar_that_fails_during_drive_stops_the_robot_at_once(lab):
    room = lab()
    rover = Rover(room.brick.link)

    def drive_on():
        while room.simulation.time_s < 10:
            rover.drive(200, 0)
            room.brick.sleep(0.1)

    room.simulation.at(1500, lambda: room.attach(4, None))
    with pytest.raises(BrickError):
        drive_on()
    raised_mm = room.simulation.truth.pose.x_mm
    room.brick.sleep(1.0)
    assert room.simulation.truth.pose.x_mm - raised_mm < 30


def test_a_link_that_fails_during_drive_is_the_error_that_is_raised_and_both_motors_are_braked(direct):
    def refuse(telegram):
        raise LinkTimeout(f"accepts no more telegrams, number {len(direct.sent)}")

    with Brick(direct) as brick:
        rover = Rover(brick.link, ultrasonic=None, touch=None)
        rover.drive(100, 0)
        sent = len(direct.sent)
        direct.on_send = refuse
        with pytest.raises(LinkTimeout, match=f"number {sent + 1}$"):
            rover.drive(200, 0)
        brakes = [telegram[1:4] for telegram in direct.sent[-2:]]
        assert brakes == [bytes((SetOutputState.opcode, port, 0)) for port in (OutputPort.B, OutputPort.C)]
        direct.on_send = lambda _: None


def test_ctrl_c_during_drive_stops_the_robot_at_once(lab):
    room = lab()
    rover = Rover(room.brick.link)
    rover.drive(200, 0)

    def interrupt():
        raise KeyboardInterrupt

    room.brick.sleep(0.5)
    room.simulation.at(room.simulation.now_ms + 1, interrupt)
    with pytest.raises(KeyboardInterrupt):
        rover.drive(200, 0)
    raised_mm = room.simulation.truth.pose.x_mm
    room.brick.sleep(1.0)
    assert room.simulation.truth.pose.x_mm - raised_mm < 30


def test_a_sensor_listener_that_uses_the_rover_is_an_error_and_the_robot_stops(lab):
    room = lab()
    rover = Rover(room.brick.link, touch=None)
    rover.on_sensor_change(lambda sensor, error: rover.stop())
    room.simulation.at(1500, lambda: room.attach(4, None))
    with pytest.raises(LocalProtocolError, match="cannot be cancelled by a guard of its own"):
        rover.straight(3000)
    room.brick.sleep(0.5)
    assert room.simulation.truth.speed_mm_s < 1
