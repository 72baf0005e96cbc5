"""A sonar that no longer returns an echo, or always the same one, is ignored."""

import numpy as np

from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.sonar_trust import SILENT_S, SonarTrust
from behaviors.adaptive.world_model import WorldModel
from behaviors.mission import Mission
from behaviors.ports import Glimpse, Pose

CELLS = Cells()


def _drive(trust, range_mm, *, begin_s=0.0, steps=40, step_mm=20.0):
    results = [trust.accepted(begin_s + 0.1 * i, Pose(begin_s * 200 + step_mm * i), range_mm(i)) for i in range(steps)]
    return results[-1]


def test_a_sonar_with_different_echoes_is_believed():
    trust = SonarTrust()
    assert _drive(trust, lambda i: 2000.0 - 20.0 * i) == 1220.0
    assert not trust.silent


def test_a_sonar_at_rest_may_always_measure_the_same():
    assert _drive(SonarTrust(), lambda _: 700.0, step_mm=0.0) == 700.0


def test_a_sonar_that_repeats_its_last_echo_on_the_way_is_not_believed_until_the_echo_changes():
    trust = SonarTrust()
    assert _drive(trust, lambda _: 700.0, steps=100) is None
    assert trust.silent
    assert _drive(trust, lambda i: 900.0 - 10.0 * i, begin_s=10.0, steps=5) == 860.0
    assert not trust.silent


def test_a_sonar_without_an_echo_for_some_time_is_silent():
    trust = SonarTrust()
    _drive(trust, lambda i: 2000.0 - i)
    _drive(trust, lambda _: None, begin_s=4.0, steps=round(5.0 * SILENT_S))
    assert not trust.silent
    _drive(trust, lambda _: None, begin_s=4.0, steps=round(12.0 * SILENT_S))
    assert trust.silent


def _turn(trust, degrees, range_mm=150.0, begin_deg=0.0):
    """Turn to one side and back again, twice."""
    for i in range(4 * 40):
        share = (i % 80) / 40
        heading_deg = begin_deg + degrees * (share if share <= 1.0 else 2.0 - share)
        trust.accepted(0.1 * i, Pose(heading_deg=heading_deg), range_mm)


def test_only_the_same_echo_on_both_sides_is_certainly_none():
    wall, stuck = SonarTrust(), SonarTrust()
    for trust, degrees in ((wall, 80.0), (stuck, 160.0)):
        _turn(trust, 10.0)
        trust.stopped = True
        _turn(trust, degrees)
    assert wall.doubtful
    assert not wall.stuck
    assert stuck.stuck


def test_a_sonar_that_stops_nothing_is_left_alone():
    trust = SonarTrust()
    _turn(trust, 160.0)
    assert not trust.doubtful
    assert not trust.stuck


def test_a_stuck_sonar_with_different_echoes_again_is_believed():
    trust = SonarTrust()
    _turn(trust, 10.0)
    trust.stopped = True
    _turn(trust, 160.0)
    assert trust.stuck
    for i in range(4):
        trust.accepted(20.0 + i, Pose(heading_deg=160.0), 500.0 + 10.0 * i)
    assert not trust.stuck


def test_the_silence_of_a_dead_sonar_clears_nothing():
    table = {"mission": {"targets": ["a"]}, "target": {"a": {"detector": "marker", "id": 0}}}
    world = WorldModel(Mission.model_validate(table))
    for i in range(10):
        world.perceive(0.1 * i, Pose(heading_deg=5.0 * i), None, [], Glimpse(0.1 * i, {}), sonar_works=False)
    x, y = CELLS.at(800.0, 0.0)
    assert world.floor.log_odds[x, y] == 0.0


def test_without_a_sonar_a_path_keeps_to_floor_that_was_driven_over():
    floor = OccupancyGrid()
    for x_mm, y_mm in [*((50.0 * i, 0.0) for i in range(17)), *((800.0, 50.0 * i) for i in range(17))]:
        floor.clear_footprint(Pose(x_mm, y_mm))
    diagonal, corner = np.array([[800.0, 800.0]]), np.array([[800.0, 0.0]])
    heard_s = PathPlanner(floor, (0.0, 0.0), 200.0).seconds_to(diagonal)
    floor.without_sonar = True
    planner = PathPlanner(floor, (0.0, 0.0), 200.0)
    assert planner.seconds_to(diagonal) > heard_s
    assert planner.seconds_to(corner) < planner.seconds_to(np.array([[400.0, 500.0]]))
