"""In another future, what has not been in view hangs at another place that can be reached and was not in view."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from nxtdrive.simulated.scenario import Scenario, generate_scenario
from nxtdrive.tools.sweep.unseen_targets import UnseenTargets
from nxtdrive.tools.sweep.what_if import Branch, run_with_branch
from nxtdrive.tools.sweep.what_if_source import GeneratedMission
from sim_backend.evaluation import scene
from sim_backend.scenarios.room_builder import CLEARANCE_MM, ROBOT_RADIUS_MM
from sim_backend.simulation import Simulation
from sim_backend.world.sensing import VIEW_RANGE_MM

FLAT = generate_scenario("flat", 7)
TARGETS = FLAT.mission.mission.targets


def _places(simulation: Simulation) -> dict[str, tuple[float, float]]:
    return {name: (at.x_mm, at.y_mm) for name, at in simulation.truth.pictures.items()}


def _hung(scenario: Scenario, future: int) -> Simulation:
    """The room after a second of looking in one direction, in a future."""
    simulation = Simulation(scenario.world, seed=1)
    unseen = UnseenTargets(simulation, scenario.mission.mission.targets, VIEW_RANGE_MM)
    simulation.advance(1000)
    unseen.hang_elsewhere(future)
    return simulation


def test_each_future_has_places_of_its_own_and_the_same_ones_each_time():
    first, again, second = (_places(_hung(FLAT, future)) for future in (1, 1, 2))
    assert first == again
    assert all(first[target] != second[target] for target in TARGETS)


@pytest.mark.parametrize("future", range(5))
def test_a_target_hangs_where_it_can_be_reached_and_was_not_in_view(future):
    simulation = _hung(FLAT, future)
    now, pose = scene(simulation), simulation.truth.pose
    goals = [now.goals[target] for target in TARGETS]
    assert now.plan.reachable((pose.x_mm, pose.y_mm), goals, ROBOT_RADIUS_MM + CLEARANCE_MM)
    assert not any(simulation.truth.in_view(target) for target in TARGETS)
    places = list(_places(simulation).values())
    assert min(math.dist(one, other) for one in places for other in places if one != other) >= 900.0


def _facing(scenario: Scenario, target: str, away_mm: float) -> Scenario:
    """The same with the robot in front of a target."""
    picture = next(each for each in scenario.world.pictures if each.name == target)
    facing = math.radians(picture.facing_deg)
    at = picture.at_mm[0] + away_mm * math.cos(facing), picture.at_mm[1] + away_mm * math.sin(facing)
    robot = scenario.world.robot.model_copy(update={"start_mm": at, "heading_deg": picture.facing_deg + 180.0})
    return replace(scenario, world=scenario.world.model_copy(update={"robot": robot}))


def test_what_was_in_view_stays():
    before, after = _places(Simulation(FLAT.world)), _places(_hung(_facing(FLAT, TARGETS[0], 700.0), 1))
    assert after[TARGETS[0]] == before[TARGETS[0]]
    assert after[TARGETS[1]] != before[TARGETS[1]]


def test_what_was_too_far_away_to_be_recognised_was_not_in_view():
    scenario = _facing(FLAT, TARGETS[0], 700.0)
    simulation = Simulation(scenario.world)
    before = _places(simulation)
    unseen = UnseenTargets(simulation, TARGETS, 500.0)
    unseen.hang_elsewhere(1)
    assert _places(simulation)[TARGETS[0]] != before[TARGETS[0]]


def test_a_picture_that_an_event_moves_stays_where_the_event_expects_it():
    moving = generate_scenario("moved", 3)
    moved = {each.picture for each in moving.world.events if each.picture}
    before, after = _places(Simulation(moving.world)), _places(_hung(moving, 1))
    assert moved
    assert all(after[picture] == before[picture] for picture in moved)


@pytest.mark.slow
def test_noting_what_is_in_view_changes_nothing_before_the_decision():
    source = GeneratedMission("wall_start", 103, "adaptive")
    plain = run_with_branch(source)
    assert run_with_branch(source, redraw_unseen=True) == plain
    one, other = (run_with_branch(source, 0, lambda at=at: Branch(0, at), redraw_unseen=True) for at in (0, 1))
    assert one.decisions[0].time_s == other.decisions[0].time_s == plain.decisions[0].time_s
    assert one.reached != other.reached
