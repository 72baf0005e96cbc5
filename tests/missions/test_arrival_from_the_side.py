"""A stop in front of a slanted print, with wrong measures of camera and wheels."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from behaviors.journal import RecordKind
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.task import run_episode

LENS_FORWARD_MM, ARRIVE_MM = 60.0, 420.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "seed"), [pytest.param("clutter", 13003, marks=pytest.mark.nightly), ("mismeasured", 12016)]
)
def test_a_slanted_print_is_not_farther_away_than_its_echo_says(kind, seed):
    scenario = generate_scenario(kind, seed)
    world = scenario.world
    robot = world.robot.model_copy(
        update={"wheel_diameter_mm": 1.08 * world.robot.wheel_diameter_mm, "track_mm": 0.92 * world.robot.track_mm}
    )
    world = world.model_copy(update={"robot": robot, "camera": world.camera.model_copy(update={"hfov_deg": 51.0})})
    trace, _ = run_episode(replace(scenario, world=world), "adaptive", "geometric")
    stops = [
        entry
        for entry in trace.entries
        if entry.record.kind is RecordKind.TRANSITION and entry.record.data["to"] == "reached"
    ]
    assert len(stops) == 2
    for stop in stops:
        x_mm, y_mm, heading_deg = stop.sample.pose
        heading = math.radians(heading_deg)
        lens = x_mm + LENS_FORWARD_MM * math.cos(heading), y_mm + LENS_FORWARD_MM * math.sin(heading)
        assert math.dist(lens, stop.sample.scene.goals[stop.record.target].at_mm) < 1.08 * ARRIVE_MM
