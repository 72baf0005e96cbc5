"""The rover's compass correction: corrections, rejections and cost."""

import logging
import math
from statistics import median

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.ports import Pose
from firmware_protocol.errors import BrickError, LocalProtocolError
from nxtdrive.mission.body import build_rover
from nxtdrive.mission.files import read_mission_file
from nxtdrive.motion.compass_correction import MAX_DRIFT_DEG_PER_M, READING_DEG, CompassFilter
from nxtdrive.motion.odometry import OdometryDelta
from nxtdrive.motion.rover import Rover, SafetyLimits
from sim_backend.devices.digital import Compass

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])
COMPASS = '[[sensors]]\nkind = "compass"\nport = 2\n'
UNGUARDED = SafetyLimits(enabled=False)
STILL_DEG = 4.0
"""A heading that a compass keeps is this good: the needle's noise, and what a turn leaves."""


def magnet(x_mm, y_mm, radius_mm, deflection_deg):
    return f"[[magnets]]\nat_mm = [{x_mm}, {y_mm}]\nradius_mm = {radius_mm}\ndeflection_deg = {deflection_deg}\n"


def slip(**kinds):
    return "[robot.slip]\n" + "".join(f"{kind} = {value}\n" for kind, value in kinds.items())


def equipped(room, compass=2):
    return Rover(room.brick.link, compass=compass, safety=UNGUARDED)


def heading_error(room, rover):
    """Of the robot at rest."""
    room.brick.sleep(1)
    return rover.pose().heading_deg - room.simulation.truth.pose.heading_deg


TEN_TURNS = pytest.mark.parametrize("extra", ["", magnet(1000, 1500, 900, 50), magnet(1400, 1500, 600, -60)])


@pytest.mark.slow
@LINKS
@TEN_TURNS
def test_ten_turns_with_slipping_wheels_are_counted_by_the_needle_at_any_place(lab, latency_ms, extra):
    room = lab(slip(turn_percent=8) + COMPASS + extra, latency_ms=latency_ms)
    rover = equipped(room)
    errors_deg = []
    for _ in range(10):
        rover.turn(360)
        errors_deg.append(abs(heading_error(room, rover)))
    assert median(errors_deg) < STILL_DEG
    assert max(errors_deg) < 2 * STILL_DEG, "29 degrees were lost in each turn; the error must not grow with them"
    assert rover.pose().heading_deg == pytest.approx(3600 * 0.92, abs=10)


def test_without_a_compass_they_are_not(lab):
    room = lab(slip(turn_percent=8) + COMPASS)
    rover = equipped(room, compass=None)
    for _ in range(10):
        rover.turn(360)
    assert heading_error(room, rover) == pytest.approx(288, abs=10)


@pytest.mark.slow
@pytest.mark.parametrize("north_deg", [270, 10, 92.5])
@pytest.mark.parametrize("turn_percent", [-8, 8])
def test_wherever_north_is(lab, north_deg, turn_percent):
    room = lab(slip(turn_percent=turn_percent) + COMPASS + f"[surroundings]\nnorth_deg = {north_deg}\n")
    rover = equipped(room)
    for angle_deg in (90, 200, -30, -360, 170, 90, 90):
        motion = rover.turn(angle_deg)
        assert abs(heading_error(room, rover)) < STILL_DEG
        assert motion.turned_deg == pytest.approx(angle_deg * (1 - turn_percent / 100), abs=2 * STILL_DEG)


@pytest.mark.parametrize("called_deg", [0, 100])
def test_a_veer_on_straight_ways_is_seen(lab, called_deg):
    room = lab(slip(veer_deg_per_m=9) + COMPASS)
    rover = equipped(room)
    rover.reset_pose(Pose(heading_deg=called_deg))
    for _ in range(6):
        rover.straight(400)
    assert room.simulation.truth.pose.heading_deg > 15
    assert abs(heading_error(room, rover) - called_deg) < STILL_DEG


@LINKS
def test_a_robot_driven_by_drive_is_corrected_at_the_next_rest(lab, latency_ms):
    room = lab(slip(turn_percent=8) + COMPASS, latency_ms=latency_ms)
    rover = equipped(room)
    for _ in range(4):
        for _ in range(40):
            rover.drive(60, 60)
            rover.pose()
            room.brick.sleep(0.1)
        rover.stop()
        assert abs(heading_error(room, rover)) < STILL_DEG


def test_a_robot_whose_lease_ran_out_is_at_rest_too(lab):
    room = lab(slip(turn_percent=20) + COMPASS)
    rover = equipped(room)
    rover.drive(0, 90)
    room.brick.sleep(2)
    rover.pose()
    assert abs(heading_error(room, rover)) < STILL_DEG


# distortion

STEEP = magnet(2000, 1500, 400, 60)
"""Iron on the way: the needle turns by 15 degrees on 100 mm."""


@pytest.mark.parametrize("legs", [[500, 500, 600], [1000, 600, 400], [900, 150, 150, 600]], ids=str)
def test_a_needle_that_jumps_is_not_believed(lab, legs):
    room = lab(COMPASS + STEEP)
    rover = equipped(room)
    for leg in legs:
        rover.straight(leg)
        assert abs(heading_error(room, rover)) < STILL_DEG


def test_turns_beside_the_iron_are_measured_and_so_is_what_comes_after(lab):
    room = lab(slip(turn_percent=8) + COMPASS + STEEP)
    rover = equipped(room)
    rover.straight(950)  # the iron is 50 mm ahead
    for _ in range(12):
        rover.turn(30)
        assert abs(heading_error(room, rover)) < STILL_DEG + 2
    rover.turn(360 - 331)
    rover.straight(800)
    rover.turn(360)
    assert abs(heading_error(room, rover)) < STILL_DEG + 2


def test_a_field_that_bends_slowly_misleads_by_its_bend_at_most_and_only_there(lab):
    room = lab(COMPASS + magnet(3000, 1500, 1500, 15))
    rover = equipped(room)
    errors = []
    for _ in range(11):
        rover.straight(350)
        errors.append(heading_error(room, rover))
    assert 8 < max(map(abs, errors)) < 15 + STILL_DEG
    assert abs(errors[-1]) < STILL_DEG


def test_a_jump_leaves_the_heading_alone_and_agreement_mends_it():
    heading = CompassFilter()
    heading.correction_deg(100, 0, OdometryDelta())
    way = OdometryDelta(500, 0, 0, 500)
    bent = READING_DEG + MAX_DRIFT_DEG_PER_M * 0.5 + 5
    assert heading.correction_deg(100 + bent, 0, way) == 0
    assert heading.correction_deg(100 + bent + 82, 90, OdometryDelta(0, 0, 90, 0)) == pytest.approx(-8)
    assert heading.correction_deg(100 + 82, 82 + 10, OdometryDelta(0, 500, 0, 500)) == pytest.approx(-10, abs=3)


def rests(heading, readings, heading_deg=0.0):
    """Give a filter readings of a robot that stands; return its heading after each."""
    after = []
    for compass_deg in readings:
        heading_deg += heading.correction_deg(compass_deg, heading_deg, OdometryDelta())
        after.append(heading_deg)
    return after


@pytest.mark.parametrize("heading_deg", [0.0, 50.0, -725.0])
def test_the_first_reading_says_where_north_is_whatever_the_heading_is_called(heading_deg):
    after = rests(CompassFilter(), [130, 130, 131], heading_deg)
    assert after == pytest.approx([heading_deg, heading_deg, heading_deg + 0.2], abs=0.1)


def test_noise_of_the_compass_is_smoothed_and_a_remaining_error_is_gone_after_twenty_readings():
    heading = CompassFilter()
    assert rests(heading, [100, 101]) == pytest.approx([0.0, 1 / 9])
    assert max(map(abs, rests(heading, [101, 99] * 30))) < 0.4
    assert rests(heading, [103] * 20)[-1] == pytest.approx(3.0, abs=0.2)


def test_beside_iron_a_turn_that_the_wheels_cannot_have_lost_is_not_corrected():
    heading, turn = CompassFilter(), OdometryDelta(0, 0, 90, 0)
    heading.correction_deg(100, 0, OdometryDelta())
    assert heading.correction_deg(200, 0, OdometryDelta(500, 0, 0, 500)) == 0
    assert heading.correction_deg(230, 90, turn) == 0, "two thirds of it"
    assert heading.correction_deg(310, 180, turn) == pytest.approx(-10)


DEFLECTIONS = st.floats(-60, 60)
MOVES = st.lists(st.one_of(st.floats(-360, 360), st.tuples(st.floats(40, 3000), DEFLECTIONS)), max_size=40)


@given(start_deg=DEFLECTIONS, moves=MOVES)
def test_a_perfect_odometer_is_misled_by_no_more_than_the_needle_is(start_deg, moves):
    heading, truth, correction, bend, worst = CompassFilter(), 0.0, 0.0, start_deg, 0.0
    heading.correction_deg(start_deg % 360, 0.0, OdometryDelta())
    for move in moves:
        if isinstance(move, tuple):
            way_mm, bend = move
            moved = OdometryDelta(way_mm, 0, 0, way_mm)
        else:
            truth += move
            moved = OdometryDelta(0, 0, move, 0)
        worst = max(worst, abs(bend - start_deg))
        correction += heading.correction_deg((truth + bend) % 360, truth + correction, moved)
        assert abs(correction) <= worst + 1e-6


# what it costs, and what goes wrong


@LINKS
def test_the_compass_is_asked_once_for_each_rest(lab, latency_ms):
    room = lab(COMPASS, latency_ms=latency_ms)
    rover = equipped(room)
    rover.turn(30)
    room.brick.sleep(0.5)
    for _ in range(5):
        begun = room.brick.now()
        rover.pose()
        assert room.brick.now() - begun == pytest.approx(latency_ms / 1000)
    for _ in range(10):
        rover.drive(100, 0)
        room.brick.sleep(0.1)
        begun = room.brick.now()
        rover.pose()
        assert room.brick.now() - begun == pytest.approx(latency_ms / 1000)


def test_readings_while_the_wheels_turn_are_dropped(lab):
    room = lab(COMPASS, latency_ms=45)
    rover = equipped(room)
    for _ in range(20):
        for _ in range(5):
            rover.drive(0, 200)
            room.brick.sleep(0.05)
        rover.stop()
        rover.pose()
    assert abs(heading_error(room, rover)) < STILL_DEG


def test_the_heading_can_be_called_otherwise(lab):
    room = lab(slip(turn_percent=8) + COMPASS)
    rover = equipped(room)
    rover.turn(90)
    rover.reset_pose(Pose(100, 200, 1000))
    before = room.simulation.truth.pose.heading_deg
    for _ in range(4):
        rover.turn(200)
    turned = room.simulation.truth.pose.heading_deg - before
    assert rover.pose().heading_deg == pytest.approx(1000 + turned, abs=STILL_DEG)


@pytest.mark.parametrize("motion", [lambda rover: rover.turn(30), lambda rover: rover.drive(50, 0), Rover.pose])
def test_a_compass_that_is_not_there_is_an_error(lab, motion):
    room = lab()
    with pytest.raises(BrickError, match="cable"):
        motion(equipped(room))
    assert room.simulation.truth.speed_mm_s == 0


def test_a_compass_that_falls_out_leaves_the_wheels(lab, caplog):
    room = lab(slip(turn_percent=8) + COMPASS)
    rover = equipped(room)
    rover.turn(90)
    room.attach(2, None)
    with caplog.at_level(logging.WARNING):
        assert all(rover.turn(90).done for _ in range(5))
    assert heading_error(room, rover) == pytest.approx(0.08 * 450, abs=5)
    assert [record.levelname for record in caplog.records] == ["WARNING"]


def test_a_program_that_listens_hears_of_a_compass_that_has_failed(lab):
    room = lab(COMPASS)
    rover, heard = equipped(room), []
    rover.on_sensor_change(lambda sensor, error: heard.append((sensor, bool(error))))
    rover.turn(30)
    room.attach(2, None)
    for _ in range(4):
        rover.turn(30)
    assert heard == [("compass", True)]


def test_a_compass_whose_bus_hangs_leaves_the_wheels(lab, caplog):
    room = lab(COMPASS)
    rover = equipped(room)
    rover.turn(90)
    room.hang_bus()
    assert all(rover.turn(90).done for _ in range(5))
    assert [record.levelname for record in caplog.records] == ["WARNING"]


def test_one_missed_answer_is_not_a_loss(lab):
    room = lab(slip(turn_percent=8) + COMPASS)
    rover = equipped(room)
    rover.turn(180)
    room.attach(2, None)
    rover.turn(180)
    room.attach(2, Compass(lambda: room.simulation.truth.pose.heading_deg + 90))
    rover.turn(180)
    assert abs(heading_error(room, rover)) < STILL_DEG


def test_each_sensor_has_a_port_of_its_own(lab):
    with pytest.raises(LocalProtocolError, match="bumper and compass both use port 1"):
        Rover(lab().brick.link, compass=1)


@pytest.mark.parametrize(("port", "wrong_deg"), [(2, 0), (0, 29)])
def test_a_mission_says_whether_there_is_a_compass(lab, port, wrong_deg):
    room = lab(slip(turn_percent=8) + COMPASS)
    mission = read_mission_file(None)
    assert mission.robot.compass == 0
    robot = mission.robot.model_copy(update={"compass": port})
    rover = build_rover(room.brick, robot)
    rover.turn(360)
    assert heading_error(room, rover) == pytest.approx(wrong_deg, abs=STILL_DEG)


def test_a_turn_not_waited_for_is_corrected_as_well(lab):
    room = lab(slip(turn_percent=8) + COMPASS)
    rover = equipped(room)
    move = rover.turn(360, wait=False)
    while not move.done:
        rover.pose()
        room.brick.sleep(0.05)
    assert move.join().turned_deg == pytest.approx(360 * 0.92, abs=5)
    assert math.isclose(heading_error(room, rover), 0, abs_tol=STILL_DEG)
