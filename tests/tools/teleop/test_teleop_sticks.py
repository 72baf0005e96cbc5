"""Conversion of sticks to speeds and commands, without a gamepad."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nxtdrive.tools.teleop.controls import DEAD_MAN_S, Controls, Direction
from nxtdrive.tools.teleop.pilot import Pilot
from nxtdrive.tools.teleop.sticks import DEADZONE, Sticks, response
from sim_backend.firmware.motors.bench_motor import BenchMotor

STOP = (0.0, 0.0)
DEFLECTIONS = st.floats(-1.1, 1.1)  # SDL's lowest is a little beyond -1
CROSS = st.sampled_from((-1, 0, 1))


@given(DEFLECTIONS)
def test_both_sides_answer_alike_and_never_beyond_full(deflection):
    assert response(-deflection) == -response(deflection)
    assert abs(response(deflection)) <= 1.0
    assert response(deflection) * deflection >= 0


@given(st.floats(-DEADZONE, DEADZONE))
def test_a_stick_that_rests_beside_its_middle_is_none(deflection):
    assert response(deflection) == 0.0


@given(DEFLECTIONS, DEFLECTIONS)
def test_farther_is_never_slower(one, other):
    less, more = sorted((one, other))
    assert response(less) <= response(more)


def test_the_end_is_full_and_the_middle_of_the_way_is_gentle():
    assert response(1.0) == 1.0
    assert 0.0 < response((1.0 + DEADZONE) / 2) < 0.4


@given(st.builds(Sticks, DEFLECTIONS, DEFLECTIONS, DEFLECTIONS, CROSS, CROSS))
def test_any_sticks_ask_for_what_the_robot_can(sticks):
    assert -1.0 <= sticks.ahead <= 1.0
    assert -1.0 <= sticks.turn <= 1.0


@pytest.mark.parametrize(
    ("sticks", "course"),
    [
        (Sticks(left_y=-1.0), (1.0, 0.0)),
        (Sticks(left_y=1.0), (-1.0, 0.0)),
        (Sticks(left_x=1.0), (0.0, 1.0)),
        (Sticks(right_x=-1.0), (0.0, -1.0)),
        (Sticks(left_y=-1.0, left_x=0.2, right_x=1.0), (1.0, 1.0)),
        (Sticks(left_x=0.3, right_x=-1.0), (0.0, -1.0)),
        (Sticks(cross_y=-1, cross_x=1), (1.0, 1.0)),
        (Sticks(left_y=0.1, left_x=-0.1), (0.0, 0.0)),
    ],
)
def test_up_is_forward_and_right_is_positive(sticks, course):
    assert (sticks.ahead, sticks.turn) == course


@pytest.fixture
def controls():
    """With a stick that is in the middle."""
    controls = Controls(300.0, 120.0)
    controls.steer(0.0, 0.0, 0.0)
    return controls


def test_a_stick_drives_in_parts_of_the_speed(controls):
    controls.steer(0.5, -1.0, 1.0)
    assert controls.wanted(1.0) == pytest.approx((0.5 * 300 * 0.6, -120 * 0.6))
    controls.faster(40)
    assert controls.wanted(1.0) == pytest.approx((150.0, -120.0))


def test_a_stick_that_is_no_longer_read_counts_only_briefly(controls):
    controls.steer(1.0, 0.0, 1.0)
    assert controls.wanted(1.0 + DEAD_MAN_S) != STOP
    assert controls.wanted(1.01 + DEAD_MAN_S) == STOP


def test_a_stick_that_is_held_still_drives_on_while_it_is_read(controls):
    for step in range(100):
        controls.steer(1.0, 0.0, step / 10)
        assert controls.wanted(step / 10) != STOP


def test_a_stick_back_in_the_middle_stops_at_once(controls):
    controls.steer(1.0, 0.0, 1.0)
    controls.steer(0.0, 0.0, 1.1)
    assert controls.wanted(1.1) == STOP


def test_a_stick_at_rest_leaves_the_keys_alone_and_a_moved_one_wins(controls):
    controls.press(Direction.BACK, 1.0)
    controls.steer(0.0, 0.0, 1.1)
    assert controls.wanted(1.1)[0] < 0
    controls.steer(1.0, 0.0, 1.2)
    assert controls.wanted(1.2)[0] > 0


def test_leaving_the_window_lets_go_of_the_keys_only(controls):
    controls.steer(1.0, 0.0, 1.0)
    controls.release_keys()
    assert controls.wanted(1.0) != STOP
    controls.steer(0.0, 0.0, 1.0)
    controls.press(Direction.BACK, 1.0)
    controls.release_keys()
    assert controls.wanted(1.0) == STOP


def _emergency(controls):
    controls.emergency_stop()
    controls.steer(1.0, 0.0, 1.0)
    assert controls.wanted(1.0) == STOP
    controls.steer(0.0, 0.0, 1.0)
    controls.steer(1.0, 0.0, 1.0)
    controls.release()


@pytest.mark.parametrize("stop", [_emergency, Controls.set_neutral])
def test_after_a_stop_the_stick_drives_only_when_it_has_been_in_the_middle(controls, stop):
    controls.steer(1.0, 0.0, 1.0)
    stop(controls)
    controls.steer(1.0, 0.0, 1.0)
    assert controls.wanted(1.0) == STOP
    controls.steer(0.0, 0.0, 1.1)
    controls.steer(1.0, 0.0, 1.2)
    assert controls.wanted(1.2) != STOP


def test_a_stick_that_is_moved_already_when_it_is_plugged_in_does_not_drive():
    controls = Controls(300.0, 120.0)
    controls.steer(1.0, 0.0, 1.0)
    assert controls.wanted(1.0) == STOP


def test_a_thumb_that_trembles_does_not_drive_held_wheels_again(room, controls):
    simulation, brick = room()
    simulation.brick.attach_motor("B", BenchMotor(locked=True))
    pilot, states = Pilot(brick, brick.rover(), controls), []
    for step in range(40):
        controls.steer(0.8 + 0.05 * (step % 2), 0.0, brick.now())
        states.append(pilot.step().state)
    assert list(dict.fromkeys(states)) == ["driving", "wheels are stuck", "wheels are stuck, let go"]
    assert states[-1] == "wheels are stuck, let go"
    controls.steer(0.0, 0.0, brick.now())
    assert pilot.step().state == "at rest"
    controls.steer(-0.8, 0.0, brick.now())
    assert pilot.step().state == "driving"
