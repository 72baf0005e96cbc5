"""The scale of turns, from echoes that repeat in a turn of more than 360 degrees."""

from __future__ import annotations

import math
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.turn_scale import ENOUGH_DEG, LONGEST_DEG, MIN_ERROR, TurnScale
from behaviors.ports import Pose
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.scenario import generate_scenario

SIDES_MM = (700.0, 1100.0, 1500.0, 900.0)
"""How far away the walls of the room are: ahead, right, behind, left."""


def echo_range_mm(heading_deg, sides_mm=SIDES_MM):
    """Return the distance to the nearest wall in a beam of 30 degrees."""
    ways = []
    for off_deg in range(-15, 16, 5):
        for side, away_mm in enumerate(sides_mm):
            along = math.cos(math.radians(heading_deg + off_deg - 90.0 * side))
            if along > 0.1:
                ways.append(away_mm / along)
    return min(ways)


def turn(scale, by_wheels_deg=LONGEST_DEG, sides_mm=SIDES_MM, step_deg=5.0):
    """Return the scale estimator after a turn by the wheels in which the robot turns `scale` times as far."""
    scale_estimator = TurnScale()
    for step in range(math.ceil(abs(by_wheels_deg) / step_deg) + 1):
        wheels_deg = math.copysign(step * step_deg, by_wheels_deg)
        scale_estimator.add(Pose(0.0, 0.0, 30.0 + wheels_deg), echo_range_mm(scale * wheels_deg, sides_mm))
    return scale_estimator


@given(st.floats(0.92, 1.08), st.sampled_from((1, -1)))
def test_the_scale_of_turns_is_found(scale, direction):
    found = turn(scale, direction * LONGEST_DEG).estimate()
    assert found == pytest.approx(scale, abs=MIN_ERROR + 0.003)


def test_a_robot_that_turns_as_far_as_its_wheels_say_is_not_corrected():
    assert turn(1.0).estimate() == 1.0


@pytest.mark.parametrize("by_wheels_deg", [0.0, 300.0, ENOUGH_DEG - 10.0])
def test_a_turn_that_is_too_short_gives_no_estimate(by_wheels_deg):
    assert turn(1.05, by_wheels_deg).estimate() is None


def test_silence_all_round_gives_no_estimate():
    assert turn(1.05, sides_mm=(5000.0,) * 4).estimate() is None


def test_a_round_room_gives_no_estimate():
    scale_estimator = TurnScale()
    for step in range(90):
        scale_estimator.add(Pose(0.0, 0.0, 5.0 * step), 800.0)
    assert scale_estimator.estimate() is None


def test_echoes_from_elsewhere_do_not_count():
    scale_estimator = turn(1.05)
    scale_estimator.add(Pose(500.0, 0.0, 0.0), 800.0)
    assert scale_estimator.estimate() is None
    assert len(scale_estimator.beams) == 1


def searched(scenario):
    """Let the adaptive profile scan once, and return it and the episode's robot; the episode is over then."""
    with closing(Episode(scenario, "geometric")) as episode:
        robot, simulation = episode.robot, episode.simulation
        context = SkillContext(*robot.ports, robot.mission.thesis, lambda *_, **__: None, lambda _: None)
        profile = AdaptiveProfile(context, robot.mission, TargetQueue(robot.mission.mission.targets))
        begin_deg = simulation.truth.pose.heading_deg
        profile.skill("search", None).call()
        turned_deg = simulation.truth.pose.heading_deg - begin_deg
        return robot.ports.body.pose().heading_deg, turned_deg


@pytest.mark.slow
@pytest.mark.parametrize("seed", [16301, 16303, 16305])
def test_a_look_round_corrects_a_robot_whose_wheels_are_not_as_believed(seed):
    """By the wheels its heading would be wrong by 6 to 30 degrees."""
    counted_deg, turned_deg = searched(generate_scenario("flat", seed))
    assert turned_deg > 360.0
    assert counted_deg == pytest.approx(turned_deg, rel=0.013)
