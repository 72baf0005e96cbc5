"""What moves in the sonar's beam, and what merely comes into it."""

import pytest

from behaviors.adaptive.recent_echoes import RecentEchoes
from behaviors.ports import Pose


def _heard(poses, range_mm):
    echoes = RecentEchoes(100.0)
    for i, pose in enumerate(poses):
        echoes.add(0.1 * i, pose, range_mm)
    return echoes


AHEAD = [Pose(40.0 * i) for i in range(8)]


def test_what_stepped_into_a_free_beam_was_not_there_before():
    assert _heard(AHEAD, 1800.0).moves(Pose(320.0), 500.0)


def test_what_the_beam_came_to_in_a_turn_was_not_seen_free_before():
    turning = [Pose(heading_deg=6.0 * i) for i in range(-8, 1)]
    assert not _heard(turning, 1800.0).moves(Pose(heading_deg=6.0), 500.0)


def test_what_has_echoed_all_the_time_was_there_before():
    echoes = RecentEchoes(100.0)
    for i, pose in enumerate(AHEAD):
        echoes.add(0.1 * i, pose, 860.0 - pose.x_mm)
    assert not echoes.moves(Pose(320.0), 540.0)


@pytest.mark.parametrize("range_mm", [None, 520.0])
def test_silence_and_near_echoes_say_nothing(range_mm):
    assert not _heard(AHEAD, range_mm).moves(Pose(320.0), 500.0)


def test_old_beams_are_forgotten():
    echoes = _heard(AHEAD, 1800.0)
    echoes.add(60.0, Pose(320.0), 500.0)
    assert not echoes.moves(Pose(320.0), 500.0)


def _in_turn(ranges_mm, *, turn_deg=0.0, driven_mm=15.0):
    """Echoes ten times a second, of a robot that drives and turns that far between two of them."""
    echoes = RecentEchoes(100.0)
    for i, range_mm in enumerate(ranges_mm):
        echoes.add(0.1 * i, Pose(driven_mm * i, 0.0, turn_deg * i), range_mm)
    return echoes.moves(Pose(driven_mm * len(ranges_mm), 0.0, turn_deg * len(ranges_mm)), ranges_mm[-1])


COMES = (2040.0, 810.0, 800.0, 620.0, 630.0, 460.0)


def test_what_comes_nearer_faster_than_the_robot_drives_moves():
    assert _in_turn(COMES)


def test_what_comes_nearer_as_the_robot_drives_does_not_move():
    assert not _in_turn([700.0 - 30.0 * i for i in range(12)], driven_mm=30.0)


def test_things_that_come_into_the_beam_do_not_move():
    assert not _in_turn((2040.0, 2030.0, 810.0, 800.0, 460.0, 450.0))


def test_a_wall_that_the_beam_sweeps_along_does_not_move():
    assert not _in_turn(COMES, turn_deg=5.0)
