"""Wheels that are blocked while the rover drives, and cases that only look like it."""

from itertools import count

import pytest

from behaviors.ports import StopReason
from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from nxtdrive.motion.rover import DriveSettings, Rover, SafetyLimits
from nxtdrive.motion.stall import STALL_S, WATCH_S, StallDetector
from sim_backend.devices import UltrasonicSensor
from sim_backend.firmware.motors.bench_motor import BenchMotor

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])
ASKS = pytest.mark.parametrize("asks_pose", [True, False], ids=["asks the pose", "does not ask"])
UNGUARDED = SafetyLimits(enabled=False)
CALL_S = 0.05


def drive_on(room, rover, speed_mm_s, turn_deg_s=0.0, *, for_s=4.0, asks_pose=False):
    """Call `drive` until it objects or `for_s` are over; returns its objection, and how long it took."""
    begun = room.brick.now()
    while room.brick.now() - begun < for_s:
        if stop := rover.drive(speed_mm_s, turn_deg_s):
            return stop, room.brick.now() - begun
        if asks_pose:
            rover.pose()
        room.brick.sleep(CALL_S)
    return None, for_s


@LINKS
@ASKS
@pytest.mark.parametrize("held", ["B", "C", "BC"])
def test_held_wheels_are_a_stall_and_braked(lab, latency_ms, held, asks_pose):
    room = lab(latency_ms=latency_ms)
    for port in held:
        room.attach(port, BenchMotor(locked=True))
    stop, took_s = drive_on(room, Rover(room.brick.link), 100, asks_pose=asks_pose)
    assert stop is StopReason.STALLED
    assert STALL_S < took_s < STALL_S + 2 * WATCH_S + 3 * latency_ms / 1000
    room.simulation.advance(100)
    assert [room.brick.request(GetOutputState(port)).power for port in (OutputPort.B, OutputPort.C)] == [0, 0]


@LINKS
def test_wheels_caught_on_the_way_are_a_stall(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    motor = room.attach("B", BenchMotor())
    rover = Rover(room.brick.link)
    assert drive_on(room, rover, 100)[0] is None
    motor.locked = True
    stop, took_s = drive_on(room, rover, 100)
    assert stop is StopReason.STALLED
    assert took_s < STALL_S + 2 * WATCH_S + 3 * latency_ms / 1000


def test_the_next_call_is_another_try(lab):
    room = lab()
    motor = room.attach("C", BenchMotor(locked=True))
    rover = Rover(room.brick.link)
    assert drive_on(room, rover, 100)[0] is StopReason.STALLED
    stop, took_s = drive_on(room, rover, 100)
    assert stop is StopReason.STALLED
    assert took_s > STALL_S
    motor.locked = False
    assert drive_on(room, rover, 100)[0] is None


@pytest.mark.slow
@LINKS
@ASKS
@pytest.mark.parametrize("battery_mv", [8000, 5500])
@pytest.mark.parametrize(
    "legs",
    [
        [(150, 0)],
        [(20, 0)],
        [(10, 0), (-10, 0)],
        [(5, 0)],
        [(0, 45)],
        [(0, 5)],
        [(100, 100)],
        [(100, 90)],
        [(50, 52)],
        [(150, 0), (-150, 0), (150, 0)],
        [(20, 0), (-20, 0), (20, 0)],
        [(800, 200)],
        [(0, 0), (100, 0), (0, 0), (100, 0)],
    ],
    ids=str,
)
def test_wheels_that_turn_are_not_a_stall(lab, latency_ms, battery_mv, legs, asks_pose):
    room = lab(f"battery_mv = {battery_mv}\n", latency_ms=latency_ms)
    rover = Rover(room.brick.link, safety=UNGUARDED)
    for leg in legs:
        assert drive_on(room, rover, *leg, for_s=2.5, asks_pose=asks_pose)[0] is None


@LINKS
def test_swaying_is_not_a_stall(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    for i in range(60):
        assert rover.drive(0, 8 if i % 2 else -8) is None
        rover.pose()
        room.brick.sleep(0.1)


@LINKS
def test_after_a_stop_for_an_obstacle_the_wheels_get_their_time_again(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    way_cm = [200]
    room.attach(4, UltrasonicSensor(lambda: way_cm[0]))
    rover = Rover(room.brick.link)
    assert drive_on(room, rover, 100, asks_pose=True)[0] is None
    for distance_cm in (10, 200) * 4:
        way_cm[0] = distance_cm
        stop, _ = drive_on(room, rover, 100, for_s=1.5, asks_pose=True)
        assert stop is (StopReason.OBSTACLE if distance_cm == 10 else None)
        for _ in range(20):  # while the program polls it
            rover.pose()
            room.brick.sleep(CALL_S)


@pytest.mark.parametrize("lease_s", [0.3, 0.6, 10])
def test_standing_after_an_expired_lease_is_not_a_stall(lab, lease_s):
    room = lab()
    rover = Rover(room.brick.link, safety=UNGUARDED, settings=DriveSettings(lease_s=lease_s))
    for pause_s in (0.2, 0.5, 0.9, 3.0, 12.0):
        assert drive_on(room, rover, 50, for_s=0.35)[0] is None
        end = room.brick.now() + pause_s
        while room.brick.now() < end:
            rover.pose()
            room.brick.sleep(0.1)
        assert rover.drive(50, 0) is None
        rover.pose()
        assert rover.drive(50, 0) is None
        rover.stop()


def test_a_robot_that_was_told_to_stand_has_its_time_to_begin(lab):
    room = lab()
    rover = Rover(room.brick.link, safety=UNGUARDED)
    rover.pose()
    rover.drive(0, 0)
    room.brick.sleep(0.55)
    assert drive_on(room, rover, 20, for_s=2.0, asks_pose=True)[0] is None


def test_driving_asks_nothing_more_while_the_pose_is_asked_for(lab):
    room = lab()
    rover = Rover(room.brick.link, ultrasonic=None, touch=None)
    for _ in range(20):
        rover.pose()
        room.brick.sleep(0.1)
        begun = room.brick.now()
        rover.drive(100, 0)
        assert room.brick.now() == begun
        room.brick.sleep(0.05)


def test_standing_counts_from_when_the_wheel_was_commanded_or_last_turned():
    wheel, times = StallDetector(0.7), count(0, 100)
    wheel.restart(0.0)
    assert not any((wheel.update(next(times) / 1000, 5), wheel.stalled)[1] for _ in range(8))
    wheel.update(0.8, 6)
    assert wheel.stalled
    wheel.update(0.9, 9)
    assert not wheel.stalled
    wheel.update(1.7, 9)
    assert wheel.stalled
    wheel.restart(1.5)
    assert not wheel.stalled


def held(wheel, *ways, turned_deg=0.0):
    """Let a wheel turn by an angle, then stall once in each of these ways."""
    wheel.update(0.0, 0.0)
    wheel.update(1.0, turned_deg)
    for way in ways:
        wheel.count(forward=way == "f")
    return wheel


@pytest.mark.parametrize(
    ("ways", "turned_deg", "dead"),
    [
        ("ff", 0, False),
        ("fff", 0, True),
        ("fff", 90, False),
        ("f" * 11, 90, False),
        ("f" * 12, 90, True),
        ("ffb", 90, False),
        ("fffb", 90, True),
        ("bbff", 90, True),
    ],
)
def test_a_wheel_is_dead_once_it_has_stalled_often_enough_whichever_way_it_is_driven(ways, turned_deg, dead):
    assert held(StallDetector(), *ways, turned_deg=turned_deg).dead is dead


def test_a_wheel_that_turns_in_between_is_not_dead():
    wheel = held(StallDetector(), *"ffb", turned_deg=90)
    wheel.update(2.0, 85)
    wheel.count(forward=True)
    assert not wheel.dead


@LINKS
def test_a_wheel_that_something_holds_one_way_is_not_dead_but_one_that_turns_no_way_is(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    motor = room.attach("B", BenchMotor())
    rover = Rover(room.brick.link, safety=UNGUARDED)
    assert drive_on(room, rover, 100)[0] is None
    for _ in range(4):
        motor.locked = True
        assert drive_on(room, rover, 100)[0] is StopReason.STALLED
        motor.locked = False
        assert rover.straight(-50).stop is StopReason.DONE
    assert rover.dead_wheels() == {}
    motor.locked = True
    for _ in range(2):
        assert drive_on(room, rover, 100)[0] is StopReason.STALLED
        assert rover.straight(-50).stop is StopReason.STALLED
    assert rover.dead_wheels() == {"left": True}
