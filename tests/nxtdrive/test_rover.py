"""The rover in a simulated room: how accurately it drives, and what stops it."""

import math
import re

import pytest

from behaviors.ports import Pose, StopReason
from firmware_protocol.direct import ResetMotorPosition, SetInputMode, SetProperty
from firmware_protocol.enums import InputPort, OutputPort, Property, SensorMode, SensorType
from firmware_protocol.errors import BrickError, LinkLost, LinkTimeout, LocalProtocolError
from nxtdrive.motion.rover import DriveSettings, Rover, SafetyLimits
from nxtdrive.ports import in_range
from nxtdrive.sensors import Ultrasonic
from sim_backend.devices import TouchSensor, UltrasonicSensor
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.link import LinkFaults

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])
BOX_AHEAD = '[[boxes]]\nname = "box"\nat_mm = [2500, 1500]\nsize_mm = [200, 1000]\nheight_mm = 300\n'
UNGUARDED = SafetyLimits(enabled=False)
FOR_EVER_MS = 10**9
TURN_TOLERANCE_DEG = 2
STRAIGHT_TOLERANCE_MM = 10


def travelled(room, before):
    now = room.simulation.truth.pose
    return math.hypot(now.x_mm - before.x_mm, now.y_mm - before.y_mm)


def settle(room):
    room.simulation.advance(1000)


@LINKS
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("angle_deg", [90, -90, 30, 180, -360, 5])
def test_turns_are_exact(lab, latency_ms, angle_deg, seed):
    room = lab(latency_ms=latency_ms, seed=seed)
    before = room.simulation.truth.pose
    motion = Rover(room.brick.link).turn(angle_deg)
    settle(room)
    turned = room.simulation.truth.pose.heading_deg - before.heading_deg
    assert motion.done
    assert turned == pytest.approx(angle_deg, abs=TURN_TOLERANCE_DEG)
    assert motion.turned_deg == pytest.approx(turned, abs=1.5)
    assert travelled(room, before) < 10


@pytest.mark.slow
@LINKS
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("distance_mm", [150, 300, 1000, -150, -500, 20])
def test_straights_are_exact(lab, latency_ms, distance_mm, seed):
    room = lab(latency_ms=latency_ms, seed=seed)
    before = room.simulation.truth.pose
    motion = Rover(room.brick.link).straight(distance_mm)
    settle(room)
    assert motion.done
    assert travelled(room, before) == pytest.approx(abs(distance_mm), abs=STRAIGHT_TOLERANCE_MM)
    assert motion.distance_mm == pytest.approx(distance_mm, abs=STRAIGHT_TOLERANCE_MM)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(0, abs=TURN_TOLERANCE_DEG)


@LINKS
@pytest.mark.parametrize(("distance_mm", "speed_mm_s"), [(40, 5), (-60, 9), (15, 1)])
def test_a_slow_straight_is_as_exact(lab, latency_ms, distance_mm, speed_mm_s):
    rover = Rover(lab(latency_ms=latency_ms).brick.link)
    motion = rover.straight(distance_mm, speed_mm_s)
    assert motion.done
    assert motion.distance_mm == pytest.approx(distance_mm, abs=3)


def test_a_slow_turn_is_as_exact(lab):
    motion = Rover(lab().brick.link, settings=DriveSettings(turn_deg_s=3)).turn(30)
    assert motion.done
    assert motion.turned_deg == pytest.approx(30, abs=TURN_TOLERANCE_DEG)


def test_without_limits_of_acceleration_a_straight_takes_hardly_longer_than_at_full_speed(lab):
    room = lab()
    settings = DriveSettings(acceleration_mm_s2=math.inf, turn_acceleration_deg_s2=math.inf)
    rover, begun_s = Rover(room.brick.link, settings=settings), room.brick.now()
    motion = rover.straight(400)
    assert motion.done
    assert motion.distance_mm == pytest.approx(400, abs=STRAIGHT_TOLERANCE_MM)
    assert room.brick.now() - begun_s < 400 / settings.speed_mm_s + 1


def test_accelerations_are_settings(lab):
    room = lab()
    settings = DriveSettings(acceleration_mm_s2=100, turn_acceleration_deg_s2=50)
    rover = Rover(room.brick.link, safety=UNGUARDED, settings=settings)
    for begin in (lambda: rover.straight(1000, wait=False), lambda: rover.turn(360, wait=False)):
        before, begun_s = room.simulation.truth.pose, room.brick.now()
        motion = begin()
        room.brick.sleep(1.0)
        assert travelled(room, before) + room.simulation.truth.pose.heading_deg - before.heading_deg < 60
        assert motion.join().done
        assert room.brick.now() - begun_s < 9.0


@LINKS
@pytest.mark.parametrize("angle_deg", [90, -90])
def test_a_curve_around_one_wheel_stops_that_wheel_first(lab, latency_ms, angle_deg):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link, safety=UNGUARDED)
    for _ in range(10):
        rover.drive(200, 0)
        room.brick.sleep(0.1)
    motion = rover.curve(112 / 2, angle_deg)
    settle(room)
    assert motion.done
    assert motion.turned_deg == pytest.approx(angle_deg, abs=5)
    assert motion.distance_mm == pytest.approx(math.radians(90) * 112 / 2, abs=15)


@LINKS
def test_the_pose_follows_the_robot_around_a_square(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    for _ in range(4):
        rover.straight(400)
        rover.turn(90)
    settle(room)
    pose, truth = rover.pose(), room.simulation.truth.pose
    assert pose.heading_deg == pytest.approx(360, abs=6)
    assert (pose.x_mm, pose.y_mm) == pytest.approx((truth.x_mm - 1000, truth.y_mm - 1500), abs=40)


def test_a_corrected_scale_of_turns_counts_for_the_last_turn_and_for_those_to_come(lab):
    room = lab()
    rover = Rover(room.brick.link, axle_track_mm=118)
    rover.turn(90)
    settle(room)
    scale = 118 / 112
    assert room.simulation.truth.pose.heading_deg == pytest.approx(90 * scale, abs=TURN_TOLERANCE_DEG)
    rover.correct_turns(scale, 90)
    assert rover.pose().heading_deg == pytest.approx(90 * scale, abs=TURN_TOLERANCE_DEG)
    rover.turn(90)
    settle(room)
    assert rover.pose().heading_deg == pytest.approx(90 * scale + 90, abs=TURN_TOLERANCE_DEG)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(90 * scale + 90, abs=2 * TURN_TOLERANCE_DEG)


def test_the_pose_can_be_set(lab):
    rover = Rover(lab().brick.link)
    rover.turn(45)
    rover.reset_pose()
    assert rover.pose() == Pose()
    rover.reset_pose(Pose(100, 200, 90))
    rover.straight(100)
    assert (rover.pose().x_mm, rover.pose().y_mm) == pytest.approx((100, 300), abs=10)


@LINKS
def test_an_obstacle_ahead_ends_the_motion_in_front_of_it(lab, latency_ms):
    room = lab(BOX_AHEAD, latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    motion = rover.straight(2000)
    settle(room)
    assert motion.stop is StopReason.OBSTACLE
    assert 140 < rover.range_mm() <= 220
    assert room.simulation.truth.contacts == 0
    again = rover.straight(100)
    assert (again.stop, again.distance_mm) == (StopReason.OBSTACLE, 0.0)
    assert rover.straight(-200).done
    assert rover.turn(180).done


@LINKS
def test_the_stop_distance_can_be_chosen(lab, latency_ms):
    room = lab(BOX_AHEAD, latency_ms=latency_ms)
    rover = Rover(room.brick.link, safety=SafetyLimits(stop_distance_mm=500))
    assert rover.straight(2000).stop is StopReason.OBSTACLE
    assert 430 < rover.range_mm() <= 520


@LINKS
def test_a_pressed_bumper_ends_the_motion(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    room.attach(1, TouchSensor(lambda: room.simulation.truth.pose.x_mm > 1300))
    rover = Rover(room.brick.link, ultrasonic=None)
    motion = rover.straight(1000)
    assert motion.stop is StopReason.CONTACT
    assert 300 <= motion.distance_mm < 400
    assert rover.straight(100).stop is StopReason.CONTACT
    assert rover.touching()
    assert rover.straight(-100).done


def test_a_real_contact_presses_it(lab):
    room = lab(BOX_AHEAD)
    motion = Rover(room.brick.link, ultrasonic=None).straight(2000)
    assert motion.stop is StopReason.CONTACT
    assert room.simulation.truth.contacts == 1


def test_a_robot_that_touches_something_does_not_push_while_the_sonar_gets_no_echo(lab):
    """Bumper and sonar are asked in turn: the sonar's turn must not let the robot drive against what it touches."""
    room = lab()
    touching = [True]
    room.attach(1, TouchSensor(lambda: touching[0]))
    room.attach(4, UltrasonicSensor(lambda: 255))
    rover = Rover(room.brick.link)
    stops = []
    for _ in range(8):
        stops.append(rover.drive(200, 0))
        room.brick.sleep(0.1)
    first = stops.index(StopReason.CONTACT)
    assert first <= 1
    assert stops[first:] == [StopReason.CONTACT] * (8 - first)
    touching[0] = False
    assert rover.drive(200, 0) is None


def test_the_safety_stop_can_be_switched_off(lab):
    room = lab()
    room.attach(1, TouchSensor(lambda: True))
    room.attach(4, UltrasonicSensor(lambda: 3))
    assert Rover(room.brick.link, safety=UNGUARDED).straight(200).done


def test_without_sensors_there_is_neither_range_nor_touch(lab):
    rover = Rover(lab().brick.link, ultrasonic=None, touch=None)
    assert rover.range_mm() is None
    assert rover.touching() is False
    assert rover.straight(200).done


@LINKS
def test_drive_continues_while_it_is_called_and_no_longer(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    for _ in range(20):
        assert rover.drive(150, 0) is None
        room.brick.sleep(0.1)
    assert room.simulation.truth.speed_mm_s == pytest.approx(150, abs=20)
    before = room.simulation.truth.pose
    room.brick.sleep(3)
    assert room.simulation.truth.speed_mm_s == 0
    assert travelled(room, before) < 200


def test_drive_turns_to_the_right_and_its_command_can_be_replaced(lab):
    room = lab()
    rover = Rover(room.brick.link)
    for _ in range(20):
        rover.drive(0, 45)
        room.brick.sleep(0.1)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(90, abs=10)
    for _ in range(20):
        rover.drive(-100, 0)
        room.brick.sleep(0.1)
    assert room.simulation.truth.pose.y_mm < 1400
    rover.stop()
    room.brick.sleep(0.3)
    assert room.simulation.truth.speed_mm_s == 0


@LINKS
def test_drive_brakes_first_and_then_says_why(lab, latency_ms):
    room = lab(BOX_AHEAD, latency_ms=latency_ms)
    rover = Rover(room.brick.link)
    stop = None
    while stop is None:
        stop = rover.drive(150, 0)
        room.brick.sleep(0.05)
        assert room.simulation.time_s < 30
    assert stop is StopReason.OBSTACLE
    settle(room)
    assert 120 < rover.range_mm() <= 220
    for _ in range(40):  # an echo may say a centimetre too much; it goes no nearer all the same
        stop = rover.drive(100, 0)
        room.brick.sleep(0.05)
    assert stop is StopReason.OBSTACLE
    assert 120 < rover.range_mm() <= 220
    assert rover.drive(-100, 0) is None


def test_held_wheels_are_a_stall(lab):
    room = lab()
    room.attach("B", BenchMotor(locked=True))
    motion = Rover(room.brick.link).straight(500)
    assert motion.stop is StopReason.STALLED
    assert room.simulation.time_s < 4


def test_weak_motors_time_out(lab):
    room = lab()
    for port in "BC":
        room.attach(port, BenchMotor(gain=20))
    assert Rover(room.brick.link).straight(500).stop is StopReason.TIMEOUT


@pytest.mark.parametrize(("fault", "error"), [("silent_ms", LinkTimeout), ("unplugged_ms", LinkLost)])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_link_that_fails_is_an_error_and_the_robot_stops_by_itself(lab, fault, error, seed):
    faults = LinkFaults(**{fault: ((2000 + 100 * seed, FOR_EVER_MS),)})
    room = lab(faults=faults, seed=seed, timeout_s=0.5)
    rover = Rover(room.brick.link)
    with pytest.raises(error):
        rover.straight(3000)
    room.simulation.advance(3000)
    assert room.simulation.truth.speed_mm_s == 0
    assert room.simulation.truth.pose.x_mm < 1000 + 3000 / 5 + 300


def test_an_interrupt_brakes_at_once(lab):
    room = lab()

    def interrupt():
        if room.simulation.truth.pose.x_mm > 1200:
            raise KeyboardInterrupt
        return False

    room.attach(1, TouchSensor(interrupt))
    with pytest.raises(KeyboardInterrupt):
        Rover(room.brick.link).straight(1000)
    room.attach(1, None)
    room.simulation.advance(500)
    assert room.simulation.truth.speed_mm_s == 0
    assert room.simulation.truth.pose.x_mm < 1250


def test_lost_replies_within_the_deadline_of_others_do_not_break_the_odometry(lab):
    room = lab(faults=LinkFaults(duplicate_replies=range(0, 10**6, 3)))
    assert Rover(room.brick.link).straight(500).distance_mm == pytest.approx(500, abs=STRAIGHT_TOLERANCE_MM)


@pytest.mark.parametrize("firmware", ["1.29", "1.05"])
@pytest.mark.parametrize(("left", "right"), [("B", "C"), ("A", "B"), ("A", "C"), ("C", "B")])
def test_any_two_ports_and_both_firmwares_do(lab, firmware, left, right):
    room = lab(f'left_port = "{left}"\nright_port = "{right}"\n', firmware=firmware)
    before = room.simulation.truth.pose
    rover = Rover(room.brick.link, left=left, right=right)
    assert rover.straight(300).done
    assert rover.turn(90).done
    settle(room)
    assert travelled(room, before) == pytest.approx(300, abs=STRAIGHT_TOLERANCE_MM)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(90, abs=TURN_TOLERANCE_DEG)


def test_reversed_motors_drive_the_other_way(lab):
    room = lab()
    Rover(room.brick.link, reversed=True, safety=UNGUARDED).straight(200)
    settle(room)
    assert room.simulation.truth.pose.x_mm == pytest.approx(800, abs=STRAIGHT_TOLERANCE_MM)


def test_a_motion_tells_its_turn_even_if_the_pose_is_set_meanwhile(lab):
    room = lab()
    rover = Rover(room.brick.link, safety=UNGUARDED)
    motion = rover.turn(90, wait=False)
    room.brick.sleep(0.5)
    rover.reset_pose(Pose(100.0, 0.0, -30.0))
    assert motion.join().turned_deg == pytest.approx(90, abs=TURN_TOLERANCE_DEG)


def test_an_echo_from_before_the_pose_was_set_stops_nothing(lab):
    room = lab(BOX_AHEAD)
    rover = room.brick.rover()
    for x_mm in (0.0, 3000.0, 6000.0):
        rover.reset_pose(Pose(x_mm, 0.0, 0.0))
        for _ in range(3):
            assert rover.drive(100.0, 0.0) is None
            room.brick.sleep(0.2)


def test_one_reversed_motor_is_corrected(lab):
    room = lab()
    rover = Rover(room.brick.link, reversed=(True, False), safety=UNGUARDED)
    assert rover.straight(100).distance_mm == pytest.approx(100, abs=STRAIGHT_TOLERANCE_MM)
    settle(room)
    # the simulated motors are not reversed, so it turns to the left on the spot instead
    wheel_turn_deg = math.degrees(100 / 56)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(-wheel_turn_deg, abs=TURN_TOLERANCE_DEG)


@pytest.mark.parametrize("mismatch_percent", [-3.0, 2.0])
def test_the_smaller_wheel_turns_farther(lab, mismatch_percent):
    room = lab()
    rover = Rover(room.brick.link, wheel_mismatch_percent=mismatch_percent, safety=UNGUARDED)
    rover.straight(500)
    settle(room)
    assert rover.pose().heading_deg == pytest.approx(0, abs=TURN_TOLERANCE_DEG)
    veer_deg = math.degrees(500 * mismatch_percent / 100 / 112)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(veer_deg, abs=TURN_TOLERANCE_DEG)


def test_a_turn_allows_for_slip(lab):
    room = lab()
    Rover(room.brick.link, turn_slip_percent=10.0).turn(90)
    settle(room)
    assert room.simulation.truth.pose.heading_deg == pytest.approx(100, abs=TURN_TOLERANCE_DEG)


def test_speeds_are_settings(lab):
    times = {}
    for speed_mm_s in (100, 300):
        room = lab()
        Rover(room.brick.link, settings=DriveSettings(speed_mm_s=speed_mm_s)).straight(1000)
        times[speed_mm_s] = room.simulation.time_s
    assert times[100] > 10 > 6 > times[300]


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"left": "B", "right": "B"}, "port B"),
        ({"ultrasonic": 1, "touch": 1}, "port 1"),
        ({"wheel_diameter_mm": 0}, "wheel_diameter_mm"),
        ({"wheel_diameter_mm": math.inf}, "wheel_diameter_mm"),
        ({"axle_track_mm": math.inf}, "axle_track_mm"),
        ({"axle_track_mm": -112}, "axle_track_mm"),
        ({"wheel_mismatch_percent": 30}, "wheel_mismatch_percent"),
        ({"turn_slip_percent": math.nan}, "turn_slip_percent"),
        ({"settings": DriveSettings(speed_mm_s=900)}, "speed_mm_s"),
        ({"settings": DriveSettings(acceleration_mm_s2=0)}, "acceleration_mm_s2"),
        ({"settings": DriveSettings(turn_deg_s=-5)}, "turn_deg_s"),
    ],
)
def test_a_robot_that_cannot_be_is_refused(lab, parts, says):
    with pytest.raises(LocalProtocolError, match=says):
        Rover(lab().brick.link, **parts)


@pytest.mark.parametrize(
    "motion",
    [
        lambda rover: rover.straight(1e6),
        lambda rover: rover.straight(100.0, 400.0),
        lambda rover: rover.turn(math.nan),
        lambda rover: rover.drive(math.inf, 0.0),
        lambda rover: rover.drive(100.0, math.nan),
        lambda rover: rover.reset_pose(Pose(0.0, math.inf, 0.0)),
        lambda rover: rover.reset_pose(Pose(heading_deg=math.nan)),
        lambda rover: rover.curve(20_000.0, 10.0),
        lambda rover: rover.curve(100.0, 4000.0),
        lambda rover: rover.correct_turns(0.4, 0.0),
        lambda rover: rover.correct_turns(2.1, 0.0),
        lambda rover: rover.correct_pose(math.nan, 0.0),
        lambda rover: rover.correct_pose(0.0, math.inf),
    ],
)
def test_motions_beyond_reason_are_refused(lab, motion):
    with pytest.raises(LocalProtocolError, match="must be from"):
        motion(Rover(lab().brick.link))


def test_a_setting_that_is_not_a_number_is_refused():
    with pytest.raises(LocalProtocolError, match="must be a number, not nan"):
        in_range("speed_mm_s", math.nan, -math.inf, math.inf)


def test_a_counter_that_is_reset_is_not_motion(lab):
    room = lab()
    rover = Rover(room.brick.link)
    rover.straight(500)
    before = rover.pose()
    for port in (OutputPort.B, OutputPort.C):
        room.brick.request(ResetMotorPosition(port, False))
    assert rover.pose() == before
    assert rover.straight(200).distance_mm == pytest.approx(200, abs=STRAIGHT_TOLERANCE_MM)


def test_a_sonar_that_falls_out_while_driving_is_an_error_and_a_stop(lab):
    room = lab()
    rover = Rover(room.brick.link)
    assert rover.straight(100).done
    room.simulation.at(room.simulation.now_ms + 1500, lambda: room.attach(4, None))
    with pytest.raises(BrickError, match="cable"):
        rover.straight(3000)
    room.simulation.advance(500)
    assert room.simulation.truth.speed_mm_s == 0


@pytest.mark.parametrize("turned_deg", [-60, 20, 150])
def test_counters_that_are_reset_to_zero_are_not_motion_however_little_the_robot_had_moved(lab, turned_deg):
    room = lab()
    rover = room.brick.rover()
    rover.turn(turned_deg)
    rover.straight(40)
    before = rover.pose()
    room.simulation.brick.output.reset()  # as switching the brick off and on does
    room.brick.sleep(0.01)
    assert rover.pose() == before


@pytest.mark.parametrize("turned_deg", [0, 5, -40])
def test_counters_that_begin_again_while_the_link_is_lost_are_not_motion(lab, turned_deg):
    room = lab(faults=LinkFaults(unplugged_ms=((10_000, 30_000),)))
    room.brick.link.reconnecting = True
    rover = room.brick.rover()
    rover.straight(1000)
    before = rover.pose()

    def nudge():
        for output in room.simulation.brick.output.outputs:
            output.control.rotation += turned_deg

    room.simulation.at(20_000, room.simulation.brick.output.reset)  # as switching the brick off and on does
    room.simulation.at(21_000, nudge)
    with pytest.raises(LinkLost, match="is back"):
        room.brick.sleep(40)
    after = rover.pose()
    assert math.dist((after.x_mm, after.y_mm), (before.x_mm, before.y_mm)) < 30


def test_what_the_wheels_coast_after_a_loss_of_the_link_is_motion(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((3000, 30_000),)))
    room.brick.link.reconnecting = True
    rover = room.brick.rover()
    with pytest.raises(LinkLost):
        rover.straight(2000)
    assert rover.pose().x_mm == pytest.approx(room.simulation.truth.pose.x_mm - 1000, abs=10)


def test_a_robot_that_returns_to_where_its_counters_began_has_moved(lab):
    rover = lab().brick.rover()
    rover.straight(100)
    rover.straight(-100)
    assert rover.pose().x_mm == pytest.approx(0, abs=3)


def test_a_program_that_listens_continues_without_the_sonar_until_it_is_back(lab):
    room = lab(BOX_AHEAD)
    rover, received = Rover(room.brick.link), []
    rover.on_sensor_change(lambda sensor, error: received.append((sensor, bool(error))))
    assert rover.range_mm() is not None
    room.simulation.at(room.simulation.now_ms + 1500, lambda: room.attach(4, None))
    assert rover.straight(1000).done
    assert received == [("sonar", True)]
    assert rover.range_mm() is None
    way_cm = [200]
    room.attach(4, UltrasonicSensor(lambda: way_cm[0]))
    room.brick.sleep(11.0)
    assert rover.range_mm() == 2000.0
    assert received == [("sonar", True), ("sonar", False)]
    room.simulation.at(room.simulation.now_ms + 800, lambda: way_cm.__setitem__(0, 15))
    assert rover.straight(300).stop is StopReason.OBSTACLE, "which it meets on the way"


def test_a_sonar_that_is_left_out_costs_a_motion_no_time(lab, mocker):
    room = lab(BOX_AHEAD)
    rover = Rover(room.brick.link)
    rover.on_sensor_change(lambda sensor, error: None)
    room.attach(4, None)
    for _ in range(3):
        assert rover.range_mm() is None
    measurements = mocker.spy(Ultrasonic, "start")
    assert rover.straight(300).done
    assert measurements.call_count == 0


def test_a_program_that_listens_continues_when_the_bus_of_the_sonar_hangs(lab):
    room = lab()
    rover, received = Rover(room.brick.link), []
    rover.on_sensor_change(lambda sensor, error: received.append((sensor, bool(error))))
    assert rover.straight(100).done
    room.simulation.at(room.simulation.now_ms + 1500, room.hang_bus)
    assert rover.straight(1500).done
    assert received == [("sonar", True)]


def test_sensors_reset_by_a_program_are_set_up_again(lab):
    room = lab(BOX_AHEAD)
    rover = Rover(room.brick.link)
    assert rover.straight(100).done
    for port in InputPort:
        room.brick.request(SetInputMode(port, SensorType.NONE, SensorMode.RAW))
    assert rover.straight(2000).stop is StopReason.OBSTACLE
    assert rover.touching() is False


def test_the_rover_takes_the_wheel_from_a_running_motor(lab):
    room = lab()
    room.brick.motor("B").run(-500)
    room.brick.sleep(1)
    assert Rover(room.brick.link).straight(300).done
    room.brick.sleep(2)
    assert room.simulation.truth.speed_mm_s == 0


def test_too_fast_a_curve_is_driven_slower_and_is_the_same_curve(lab):
    room = lab()
    rover = Rover(room.brick.link, safety=UNGUARDED)

    def drive_on():
        for _ in range(10):
            rover.drive(800, 200)
            room.brick.sleep(0.1)
        return room.simulation.truth.pose

    before, after = drive_on(), drive_on()
    turned = math.radians(after.heading_deg - before.heading_deg)
    chord_mm = math.hypot(after.x_mm - before.x_mm, after.y_mm - before.y_mm)
    assert chord_mm / (2 * math.sin(turned / 2)) == pytest.approx(800 / math.radians(200), rel=0.1)
    assert turned < math.radians(200) / 1.5


def test_battery_and_keep_alive_pass_through(lab):
    room = lab()
    rover = room.brick.rover()
    room.brick.request(SetProperty(Property.SLEEP_TIME, (120_000).to_bytes(4, "little")))
    rover.keep_alive()
    assert rover.battery_mv() == room.brick.battery_v * 1000
    room.brick.sleep(200)
    assert not room.simulation.brick.powered_off


def test_a_rover_with_small_wheels_drives_as_fast_as_they_allow(lab):
    room = lab()
    rover = room.brick.rover(wheel_diameter_mm=28.0)
    assert rover.straight(300).stop is StopReason.DONE
    with pytest.raises(LocalProtocolError, match="speed_mm_s must be above 0 and at most 181 with these wheels"):
        room.brick.rover(wheel_diameter_mm=28.0, settings=DriveSettings(speed_mm_s=200.0))


def test_the_largest_speed_that_the_error_names_is_accepted(lab):
    brick = lab().brick
    with pytest.raises(LocalProtocolError) as refused:
        brick.rover(settings=DriveSettings(speed_mm_s=363.0))
    named = re.search(r"at most (\d+)", str(refused.value))
    assert brick.rover(settings=DriveSettings(speed_mm_s=float(named[1]))).settings.speed_mm_s == 362.0
    with pytest.raises(LocalProtocolError, match="acceleration_mm_s2 must be above 0, not 0"):
        brick.rover(settings=DriveSettings(acceleration_mm_s2=0))
