"""The line follower on a simulated line; docs/testing-your-robot.md explains the fixtures."""

import math
import tomllib
from itertools import pairwise
from pathlib import Path

import pytest
from line_follower import calibrate, follow

WORLD = Path(__file__).with_name("line.toml")
LINE = tomllib.loads(WORLD.read_text(encoding="utf-8"))["patches"][0]["along_mm"]
SENSOR_MM = 80


def distance_to_line_mm(pose):
    """How far the light sensor is from the middle of the tape."""
    heading = math.radians(pose.heading_deg)
    x, y = pose.x_mm + SENSOR_MM * math.cos(heading), pose.y_mm + SENSOR_MM * math.sin(heading)
    return min(_distance(x, y, *begin, *end) for begin, end in pairwise(LINE))


def _distance(x, y, x0, y0, x1, y1):
    along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / ((x1 - x0) ** 2 + (y1 - y0) ** 2)
    along = min(1, max(0, along))
    return math.hypot(x - x0 - along * (x1 - x0), y - y0 - along * (y1 - y0))


@pytest.mark.parametrize(
    "way_deg",
    [
        pytest.param(120, marks=pytest.mark.sim_world(WORLD, latency_ms=2), id="USB"),
        pytest.param(360, marks=pytest.mark.sim_world(WORLD, latency_ms=45), id="Bluetooth, for a lap"),
    ],
)
def test_it_stays_on_the_line(way_deg, sim_world, sim_brick):
    edge = calibrate(sim_brick)
    headings = [sim_world.truth.pose.heading_deg]
    while headings[-1] < headings[0] + way_deg:
        follow(sim_brick, edge, duration_s=1)
        headings.append(sim_world.truth.pose.heading_deg)
        assert distance_to_line_mm(sim_world.truth.pose) < 60
        assert sim_world.time_s < 120


@pytest.mark.sim_world(WORLD)
def test_it_learns_the_brightness_of_this_floor(sim_brick):
    assert calibrate(sim_brick) == pytest.approx(50, abs=5)  # black tape reads 32, white paper 68
