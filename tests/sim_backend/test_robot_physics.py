"""The simulated robot: motors, wheels, friction and collisions."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sim_backend.world.motor import WheelMotor

MM_PER_DEG = math.pi * 56.0 / 360.0
ROOM = "[floor]\nsize_mm = [4000, 3000]\n[robot]\nstart_mm = [1000, 1500]"
WALL_AHEAD = "[[walls]]\nfrom_mm = [1500, 500]\nto_mm = [1500, 2500]\n"
ROBOT_AT_THE_WALL_MM = 1500 - 10 - 115


def settled_speed(motor, pwm):
    for _ in range(600):
        motor.step(pwm, True)
    return motor.free_speed


def test_the_motor_reaches_its_no_load_speed_at_full_battery():
    assert settled_speed(WheelMotor(8000), 100) == pytest.approx(855, abs=1)


def test_the_motor_is_as_fast_as_its_battery_is_full():
    assert settled_speed(WheelMotor(6000), 80) == pytest.approx(0.75 * settled_speed(WheelMotor(8000), 80))


@pytest.mark.parametrize(("pwm", "moves"), [(5, False), (-5, False), (6, True), (-6, True)])
def test_the_gears_have_a_dead_zone(pwm, moves):
    assert (settled_speed(WheelMotor(), pwm) != 0) is moves


@pytest.mark.parametrize(("pwm", "full"), [(127, 100), (-128, -100)])
def test_power_saturates_at_100_percent(pwm, full):
    assert settled_speed(WheelMotor(), pwm) == settled_speed(WheelMotor(), full)


def test_after_60_ms_the_motor_has_63_percent_of_its_speed():
    motor = WheelMotor()
    for _ in range(60):
        motor.step(100, True)
    assert motor.free_speed == pytest.approx(855 * (1 - math.exp(-1)), rel=0.01)


def test_the_brake_stops_sooner_than_coasting():
    ways = {}
    for brake in (True, False):
        motor = WheelMotor()
        settled_speed(motor, 100)
        before = motor.angle
        while not motor.at_rest:
            motor.step(0, brake)
        ways[brake] = motor.angle - before
    assert ways[True] == pytest.approx(10, abs=1)
    assert ways[False] == pytest.approx(127, abs=5)


def test_counts_are_whole_degrees_and_none_is_lost():
    motor = WheelMotor()
    counts = sum(motor.step(pwm, True) for pwm in [70] * 300 + [-40] * 500 + [0] * 100)
    assert counts == math.floor(motor.angle)


def test_driving_straight_goes_as_far_as_the_wheels_count(world, drive):
    room = world()
    drive(room, 2000, 60, 60)
    drive(room, 300)
    driven_mm = room.robot.left.angle * MM_PER_DEG
    assert driven_mm > 400
    assert room.robot.x_mm - 1000 == pytest.approx(driven_mm, rel=0.01)
    assert room.robot.y_mm == pytest.approx(1500, abs=0.1)


def test_a_stronger_right_motor_veers_to_the_left(world, drive):
    room = world(base=f"{ROOM}\nmotor_mismatch_percent = 2")
    drive(room, 2000, 60, 60)
    assert room.robot.heading_deg < -2


def test_turning_on_the_spot_turns_as_far_as_the_wheels_count(world, drive):
    room = world()
    drive(room, 900, 50, -50)
    drive(room, 300)
    wheels_deg = (room.robot.left.angle - room.robot.right.angle) / 2 * 56 / 112
    assert wheels_deg > 80
    assert room.robot.heading_deg == pytest.approx(wheels_deg, rel=0.02)
    assert (room.robot.x_mm, room.robot.y_mm) == pytest.approx((1000, 1500), abs=1)


def test_lost_distance_and_turn_are_not_counted_by_the_wheels(world, drive):
    slip = "slip = { jitter_percent = 0, distance_percent = 10, veer_deg_per_m = 20 }"
    room = world(base=f"{ROOM}\nmotor_mismatch_percent = 0\n{slip}")
    drive(room, 2000, 60, 60)
    driven_mm = room.robot.left.angle * MM_PER_DEG
    way_mm = math.dist((1000, 1500), (room.robot.x_mm, room.robot.y_mm))
    assert way_mm == pytest.approx(0.9 * driven_mm, rel=0.01)
    assert room.robot.heading_deg == pytest.approx(20 * way_mm / 1000, rel=0.02)


def test_a_wall_stops_the_robot_and_stalls_weak_wheels(world, drive):
    room = world(WALL_AHEAD)
    drive(room, 4000, 40, 40)
    assert room.robot.x_mm == pytest.approx(ROBOT_AT_THE_WALL_MM, abs=1)
    angle = room.robot.left.angle
    drive(room, 1000, 15, 15)
    drive(room, 1000, 15, 15)
    assert room.robot.left.angle - angle < 30
    assert room.contact_count == 1


def test_strong_wheels_slip_at_a_wall(world, drive):
    room = world(WALL_AHEAD)
    drive(room, 4000, 60, 60)
    angle, x_mm = room.robot.left.angle, room.robot.x_mm
    drive(room, 1000, 60, 60)
    assert room.robot.left.angle - angle > 200
    assert room.robot.x_mm == pytest.approx(x_mm, abs=1)


def test_even_weak_wheels_can_back_off_from_a_wall(world, drive):
    room = world(WALL_AHEAD)
    drive(room, 4000, 40, 40)
    drive(room, 2000, -12, -12)
    assert room.robot.x_mm < ROBOT_AT_THE_WALL_MM - 30
    assert not room.robot.bumper_pressed


@pytest.mark.parametrize(("pwm", "pressed"), [(40, True), (-40, False)])
def test_only_the_front_has_a_bumper(world, drive, pwm, pressed):
    walls = WALL_AHEAD + "[[walls]]\nfrom_mm = [700, 500]\nto_mm = [700, 2500]\n"
    room = world(walls)
    drive(room, 4000, pwm, pwm)
    assert room.contact_count == 1
    assert room.robot.bumper_pressed is pressed


def test_a_box_can_be_pushed_only_if_it_has_a_mass(world, drive):
    box = "[[boxes]]\nname = 'b'\nat_mm = [1400, 1500]\nsize_mm = [200, 300]\nheight_mm = 200\n"
    light, fixed = world(box + "mass_kg = 0.3"), world(box)
    for room in (light, fixed):
        drive(room, 4000, 60, 60)
    assert light.boxes["b"].at_mm[0] > 1500
    assert fixed.boxes["b"].at_mm[0] == 1400


def test_a_box_too_heavy_for_the_tyres_stays(world, drive):
    room = world("[[boxes]]\nname = 'b'\nat_mm = [1400, 1500]\nsize_mm = [200, 300]\nheight_mm = 200\nmass_kg = 5")
    drive(room, 4000, 60, 60)
    assert room.boxes["b"].at_mm[0] == pytest.approx(1400, abs=5)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(-128, 127), st.integers(-128, 127)), min_size=1, max_size=12))
def test_no_power_drives_the_robot_out_of_the_room(world, drive, powers):
    room = world("[[boxes]]\nname = 'b'\nat_mm = [1300, 1500]\nsize_mm = [200, 300]\nheight_mm = 200\nmass_kg = 0.2")
    for left, right in powers:
        drive(room, 800, left, right)
        assert 110 < room.robot.x_mm < 4000 - 110
        assert 110 < room.robot.y_mm < 3000 - 110
