"""A bumper that sticks is left out; one that touches something, again and again, is not."""

import pytest

from behaviors.ports import Pose, StopReason
from nxtdrive.motion.bumper_trust import BumperTrust
from nxtdrive.motion.rover import Rover
from sim_backend.devices import TouchSensor

BACK = [(True, 0, 0), (True, -80, 0), (True, -160, 0)]
TURNED = [(True, 0, 0), (True, 0, 200), (True, 0, 400)]


@pytest.mark.parametrize(
    ("readings", "sticks"),
    [
        (BACK[:2], False),
        (BACK, True),
        (TURNED[:2], False),
        (TURNED, True),
        ([(True, 0, 0), (True, 30, 0), (True, -10, 0), (True, -50, 0), (True, 40, 0)], False),
        ([(True, 0, 0), (True, 0, -90), (True, 0, 45)], False),
        ([(True, 0, 0), (True, -80, 0), (False, -80, 0), (True, -160, 0)], False),
        ([*BACK, (True, -100, 90)], True),
        ([*BACK, (False, -160, 0)], False),
    ],
)
def test_a_bumper_sticks_that_stays_pressed_when_the_robot_backs_off_or_turns(readings, sticks):
    trust = BumperTrust()
    assert [trust.sticks(pressed, Pose(x_mm, 0.0, deg)) for pressed, x_mm, deg in readings][-1] is sticks


@pytest.fixture
def bumper(lab):
    room, pressed = lab(), [True]
    room.attach(1, TouchSensor(lambda: pressed[0]))
    rover = Rover(room.brick.link, ultrasonic=None)
    return room, rover, pressed


def back_off(rover, times):
    stops = []
    for _ in range(times):
        stops.append(rover.straight(30).stop)
        rover.straight(-80)
    return stops


def test_a_bumper_that_sticks_is_left_out_until_it_is_released(bumper):
    room, rover, pressed = bumper
    heard = []
    rover.on_sensor_change(lambda *change: heard.append(change))
    stops = back_off(rover, 8)
    assert stops[:2] == [StopReason.CONTACT] * 2
    assert stops[-1] is StopReason.DONE
    assert heard == [
        ("bumper", "it stays pressed when the robot backs off. Does something jam it, or is its cable damaged?")
    ]
    room.brick.sleep(11.0)
    assert not rover.touching()
    assert len(heard) == 1
    pressed[0] = False
    room.brick.sleep(11.0)
    assert not rover.touching()
    assert heard[1:] == [("bumper", "")]
    pressed[0] = True
    assert rover.touching()


def test_an_ordinary_program_gets_the_readings_as_they_are(bumper):
    _, rover, _ = bumper
    assert back_off(rover, 8) == [StopReason.CONTACT] * 8
    assert rover.touching()
