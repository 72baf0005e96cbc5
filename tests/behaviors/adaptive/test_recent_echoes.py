"""Obstacles that appeared in the sonar's beam, and obstacles that the beam reached by turning."""

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
    assert _heard(AHEAD, 1800.0).appeared(Pose(320.0), 500.0)


def test_what_the_beam_came_to_in_a_turn_was_not_seen_free_before():
    turning = [Pose(heading_deg=6.0 * i) for i in range(-8, 1)]
    assert not _heard(turning, 1800.0).appeared(Pose(heading_deg=6.0), 500.0)


def test_what_has_echoed_all_the_time_was_there_before():
    echoes = RecentEchoes(100.0)
    for i, pose in enumerate(AHEAD):
        echoes.add(0.1 * i, pose, 860.0 - pose.x_mm)
    assert not echoes.appeared(Pose(320.0), 540.0)


@pytest.mark.parametrize("range_mm", [None, 520.0])
def test_silence_and_near_echoes_say_nothing(range_mm):
    assert not _heard(AHEAD, range_mm).appeared(Pose(320.0), 500.0)


def test_old_beams_are_forgotten():
    echoes = _heard(AHEAD, 1800.0)
    echoes.add(60.0, Pose(320.0), 500.0)
    assert not echoes.appeared(Pose(320.0), 500.0)
