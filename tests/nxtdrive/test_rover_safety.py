"""The safety stop's limits, and the motors after an error of `Rover.drive`."""

import math

import pytest

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import BrickError, LinkTimeout, LocalProtocolError
from nxtdrive.brick import Brick
from nxtdrive.motion.rover import Rover, SafetyLimits


@pytest.mark.parametrize("distance_mm", [math.nan, math.inf, -1, 2551, "200", None, True])
def test_a_stop_distance_that_would_not_stop_the_robot_is_refused(distance_mm):
    with pytest.raises(LocalProtocolError, match="stop_distance_mm must be"):
        SafetyLimits(stop_distance_mm=distance_mm)


@pytest.mark.parametrize("distance_mm", [0, 30.5, 2550])
def test_any_distance_that_the_sonar_measures_may_be_the_stop_distance(distance_mm):
    assert SafetyLimits(stop_distance_mm=distance_mm).stop_distance_mm == distance_mm


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
