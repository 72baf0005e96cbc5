"""Attempts by place, and whether an approach is a new one."""

import pytest

from behaviors.adaptive.attempts import REMEMBERED_S, SAME_PLACE_MM, Attempts
from behaviors.events import Reason

HERE, AIM = (0.0, 0.0), (900.0, 0.0)
NEAR, ELSEWHERE = (0.8 * SAME_PLACE_MM, 0.0), (1.2 * SAME_PLACE_MM, 0.0)


def test_repetitions_are_counted_for_each_place_target_and_recovery():
    attempts = Attempts()
    assert attempts.repeats("door", HERE) == {}
    attempts.chose("door", "wait", HERE)
    attempts.chose("door", "wait", HERE)
    attempts.chose("door", "rescan", HERE)
    attempts.chose("window", "detour", HERE)
    assert attempts.repeats("door", HERE) == {"wait": 2, "rescan": 1}
    assert attempts.repeats("window", HERE) == {"detour": 1}
    assert attempts.repeats("door", NEAR) == {"wait": 2, "rescan": 1}
    assert attempts.repeats("door", ELSEWHERE) == {}


def test_a_destination_was_tried_from_the_same_place():
    attempts = Attempts()
    attempts.chose("door", "move_to", HERE, AIM)
    assert attempts.tried("door", NEAR, (900.0, 100.0))
    assert not attempts.tried("door", ELSEWHERE, AIM)
    assert not attempts.tried("door", HERE, (900.0, 400.0))
    assert not attempts.tried("window", HERE, AIM)


def test_failures_are_counted_for_each_place_and_reason_and_turn():
    attempts = Attempts()
    assert attempts.failures() == (0, 0)
    counted = []
    for target, turn, reason, place in (
        ("door", 1, Reason.BLOCKED_LONG, HERE),
        ("door", 1, Reason.NO_WAY, HERE),
        ("door", 1, Reason.BLOCKED_LONG, NEAR),
        ("door", 1, Reason.BLOCKED_LONG, HERE),
        ("door", 1, Reason.BLOCKED_LONG, ELSEWHERE),
        ("door", 2, Reason.BLOCKED_LONG, HERE),
        ("window", 2, Reason.BLOCKED_LONG, HERE),
    ):
        attempts.failed(target, turn, reason, place)
        counted.append(attempts.failures())
    assert counted == [(1, 1), (1, 1), (2, 1), (3, 2), (2, 3), (1, 1), (1, 1)]


def test_slips_are_at_one_place_wherever_odometry_puts_them():
    """While the wheels spin, odometry counts on."""
    attempts = Attempts()
    for x_mm in (0.0, 430.0, 860.0):
        attempts.failed("door", 1, Reason.SLIPPED, (x_mm, 0.0))
    assert attempts.failures() == (3, 3)


@pytest.mark.parametrize("places_mm", [(0, 200, -200), (0, -240, 240), (0, 240, 0)])
def test_failures_to_and_fro_about_a_place_are_in_a_row(places_mm):
    attempts = Attempts()
    for x_mm in places_mm:
        attempts.failed("door", 1, Reason.BLOCKED_LONG, (float(x_mm), 0.0))
    assert attempts.failures()[1] == 3


def test_a_robot_that_gets_on_does_not_fail_in_a_row():
    attempts = Attempts()
    for x_mm in (0.0, 200.0, 400.0, 600.0):
        attempts.failed("door", 1, Reason.BLOCKED_LONG, (x_mm, 0.0))
    assert attempts.failures()[1] == 2


@pytest.mark.parametrize(
    ("start", "aim", "later_s", "new"),
    [
        pytest.param(HERE, AIM, 1.0, False, id="the same again"),
        pytest.param((-500.0, 50.0), AIM, 1.0, False, id="past the same place from farther away"),
        pytest.param((300.0, 500.0), AIM, 1.0, True, id="from aside"),
        pytest.param((400.0, 0.0), AIM, 1.0, True, id="from beyond"),
        pytest.param(HERE, (900.0, 600.0), 1.0, True, id="to where the target is now"),
        pytest.param(HERE, AIM, 1.1 * REMEMBERED_S, True, id="long after"),
    ],
)
def test_an_approach_is_new_when_it_leads_clear_of_where_one_failed(start, aim, later_s, new):
    attempts = Attempts()
    attempts.approach_failed("door", HERE, AIM, 10.0)
    assert attempts.new_approach("door", start, aim, 10.0 + later_s) == new
    assert attempts.new_approach("window", start, aim, 10.0 + later_s)
