"""The wall follower in a simulated room; docs/testing-your-robot.md explains the fixtures."""

import math
from pathlib import Path

import pytest
from wall_follower import WALL_MM, follow

WORLD = Path(__file__).with_name("corridor.toml")
CENTRE_MM = (2000, 1500)


def bearing_deg(pose):
    """Where the robot is, seen from the middle of the room."""
    return math.degrees(math.atan2(pose.y_mm - CENTRE_MM[1], pose.x_mm - CENTRE_MM[0]))


@pytest.mark.sim_world(WORLD)
def test_it_goes_round_corners_with_the_wall_to_its_right(sim_world, sim_brick):
    travelled, before = 0.0, bearing_deg(sim_world.truth.pose)
    while travelled > -120:
        follow(sim_brick, duration_s=1)
        now = bearing_deg(sim_world.truth.pose)
        travelled += (now - before + 180) % 360 - 180  # anticlockwise is negative
        before = now
        assert sim_world.time_s < 180
    assert sim_world.truth.contacts < 5


@pytest.mark.sim_world(WORLD)
def test_it_keeps_its_distance_along_a_straight_wall(sim_world, sim_brick):
    follow(sim_brick, duration_s=4)
    assert sim_world.truth.contacts == 0
    assert sim_brick.ultrasonic(2).distance_mm == pytest.approx(WALL_MM, abs=60)
