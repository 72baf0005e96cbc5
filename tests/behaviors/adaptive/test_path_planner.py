"""Paths over the grid: their duration, how they avoid obstacles, and places without a path."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from behaviors.adaptive.grid_cells import CELL_MM, Cells
from behaviors.adaptive.grid_tuning import HINT, MAX_LOG_ODDS, SOLID
from behaviors.adaptive.occupancy_grid import USUAL_ROBOT, OccupancyGrid
from behaviors.adaptive.path_planner import PathPlanner
from behaviors.ports import Point, Pose

CELLS = Cells()

SPEED_MM_S = 200.0
HALF_ROOM_MM = 2000.0
START = (0.0, 0.0)
X_MM = CELLS.centre_mm(np.arange(CELLS.side))[:, None]
Y_MM = CELLS.centre_mm(np.arange(CELLS.side))[None, :]
Disc = tuple[float, float, float]


def _room() -> OccupancyGrid:
    """A square room that is known to be free, with solid walls around it."""
    floor = OccupancyGrid()
    distance_mm = np.maximum(np.abs(X_MM), np.abs(Y_MM))
    floor.log_odds[distance_mm < HALF_ROOM_MM] = -1.0
    floor.log_odds[(distance_mm >= HALF_ROOM_MM) & (distance_mm < HALF_ROOM_MM + 3 * CELL_MM)] = MAX_LOG_ODDS
    return floor


def _with_discs(discs: list[Disc]) -> OccupancyGrid:
    floor = _room()
    for x_mm, y_mm, radius_mm in discs:
        floor.log_odds[np.hypot(X_MM - x_mm, Y_MM - y_mm) <= radius_mm] = MAX_LOG_ODDS
    return floor


def _route_mm(route: tuple[Point, ...], start: Point = START) -> float:
    return sum(math.dist(one, other) for one, other in pairwise([start, *route]))


def _along(route: tuple[Point, ...], start: Point = START) -> list[Point]:
    """Places on the straight legs of a way."""
    places = []
    for one, other in pairwise([start, *route]):
        for share in np.linspace(0.0, 1.0, max(2, round(math.dist(one, other) / 10.0))):
            places.append((one[0] + share * (other[0] - one[0]), one[1] + share * (other[1] - one[1])))
    return places


def _solid_on(floor: OccupancyGrid, route: tuple[Point, ...], start: Point = START) -> list[Point]:
    """Places on the straight legs of a way that are solid."""
    return [place for place in _along(route, start) if floor.log_odds[CELLS.at(*place)] > SOLID]


@pytest.mark.parametrize(("log_odds", "crosses"), [(0.4, True), (1.2, False)])
def test_what_one_far_echo_suspects_is_crossed_sooner_than_what_several_show(log_odds, crosses):
    floor = _room()
    floor.log_odds[(np.abs(X_MM - 600.0) < CELL_MM) & (Y_MM > -1000.0) & (Y_MM < HALF_ROOM_MM)] = log_odds
    route = PathPlanner(floor, START, SPEED_MM_S).route_to((1300.0, 300.0))
    assert any(floor.log_odds[CELLS.at(*place)] > 0 for place in _along(route)) is crosses


@pytest.mark.parametrize("goal", [(1200.0, 0.0), (0.0, -1200.0), (900.0, 900.0), (1200.0, -500.0), (-700.0, 1300.0)])
def test_on_free_floor_the_way_is_straight_and_takes_its_time(goal):
    routes = PathPlanner(_room(), START, SPEED_MM_S)
    straight_s = math.dist(START, goal) / SPEED_MM_S
    cell_s = CELL_MM / SPEED_MM_S
    (seconds,) = routes.seconds_to(np.array([goal]))
    assert straight_s - cell_s <= seconds <= 1.09 * straight_s + cell_s  # a grid's ways are up to 8 % longer
    assert routes.route_to(goal) == (goal,)


def test_a_wall_is_gone_round():
    floor = _room()
    floor.log_odds[(X_MM > 800.0) & (X_MM < 1000.0) & (np.abs(Y_MM) <= 1000.0)] = MAX_LOG_ODDS
    goal = (1500.0, 0.0)
    routes = PathPlanner(floor, START, SPEED_MM_S)
    route = routes.route_to(goal)
    around_mm = 2 * math.hypot(900.0, 1000.0)
    assert routes.seconds_to(np.array([goal]))[0] >= around_mm * 0.9 / SPEED_MM_S
    assert max(abs(y_mm) for _, y_mm in route) >= 1000.0 + USUAL_ROBOT.radius_mm
    assert not _solid_on(floor, route)
    assert _route_mm(route) < 1.5 * around_mm


@pytest.mark.parametrize("shift_mm", [0.0, 30.0, 55.0])
@pytest.mark.parametrize("along_x", [True, False])
def test_a_door_of_480_mm_is_passed(shift_mm, along_x):
    floor = _room()
    across, along = (X_MM, Y_MM) if along_x else (Y_MM, X_MM)
    door = np.abs(along - shift_mm) < 240.0
    floor.log_odds[(np.abs(across - 1000.0) < 100.0) & ~door] = MAX_LOG_ODDS
    goal = (1500.0, 0.0) if along_x else (0.0, 1500.0)
    routes = PathPlanner(floor, START, SPEED_MM_S)
    assert routes.reaches(goal)
    assert not _solid_on(floor, routes.route_to(goal))
    assert routes.seconds_to(np.array([goal]))[0] < 3 * 1500.0 / SPEED_MM_S


def _with_gap(log_odds: float) -> OccupancyGrid:
    """A room with a wall across it, in which a gap is narrower than the robot."""
    floor = _room()
    wall = np.abs(X_MM - 1000.0) < 100.0
    floor.log_odds[wall & (np.abs(Y_MM) > 100.0)] = MAX_LOG_ODDS
    floor.log_odds[wall & (np.abs(Y_MM) <= 100.0)] = log_odds
    return floor


@pytest.mark.parametrize(("log_odds", "reached"), [(-1.0, True), (0.0, False), (HINT, False)])
def test_a_gap_that_looks_too_narrow_is_a_door_only_where_its_floor_is_known_to_be_free(log_odds, reached):
    """A wide beam makes a door look narrower than it is, but no echo leaves free floor between two posts."""
    assert PathPlanner(_with_gap(log_odds), START, SPEED_MM_S).reaches((1500.0, 0.0)) is reached


def test_a_short_way_round_is_better_than_a_gap_that_looks_too_narrow():
    goal, narrow = (1500.0, 0.0), _with_gap(-1.0)
    round_it = _with_gap(-1.0)
    round_it.log_odds[(np.abs(X_MM - 1000.0) < 100.0) & (Y_MM > 600.0) & (Y_MM < 1400.0)] = -1.0
    through_s, round_s = (PathPlanner(f, START, SPEED_MM_S).seconds_to(np.array([goal]))[0] for f in (narrow, round_it))
    assert round_s < through_s
    assert max(y_mm for _, y_mm in PathPlanner(round_it, START, SPEED_MM_S).route_to(goal)) > 600.0


def test_a_place_without_a_path_takes_forever():
    floor = _room()
    floor.log_odds[np.abs(X_MM[:, 0] - 1000.0) < 100.0] = MAX_LOG_ODDS
    routes = PathPlanner(floor, START, SPEED_MM_S)
    behind, here = (1500.0, 0.0), (500.0, 0.0)
    seconds = routes.seconds_to(np.array([behind, here]))
    assert math.isinf(seconds[0])
    assert math.isfinite(seconds[1])
    assert not routes.reaches(behind)
    assert routes.reaches(here)


def test_far_beyond_the_known_floor_there_is_no_path():
    routes = PathPlanner(_room(), START, SPEED_MM_S)
    assert not routes.reaches((6500.0, 6500.0))
    assert not routes.reaches((1e6, -1e6))


def test_unknown_floor_may_be_crossed_but_takes_longer_than_free_floor():
    known, unknown = (PathPlanner(floor, START, SPEED_MM_S) for floor in (_room(), OccupancyGrid()))
    goal = np.array([(480.0, 0.0)])
    assert known.seconds_to(goal)[0] < unknown.seconds_to(goal)[0] < math.inf


def test_the_unknown_floor_on_a_path_is_measured():
    floor = _room()
    unknown = (X_MM[:, 0] > 600.0) & (X_MM[:, 0] < 1000.0)
    floor.log_odds[unknown] = 0.0
    routes = PathPlanner(floor, START, SPEED_MM_S)
    assert routes.unknown_mm(((500.0, 0.0), (500.0, 700.0))) == 0.0
    assert routes.unknown_mm(((500.0, 0.0), (1500.0, 0.0))) == pytest.approx(CELL_MM * unknown.sum(), abs=CELL_MM / 2)
    assert routes.unknown_mm(((1e6, 0.0),)) == 1e6  # far beyond the map


def test_the_robot_can_leave_a_place_that_is_too_near_to_something():
    """As after a contact: what blocks the way has just been marked right before the robot."""
    floor = _room()
    floor.mark_obstacle(Pose(), 0.0)
    routes = PathPlanner(floor, START, SPEED_MM_S)
    behind, beyond = (-800.0, 0.0), (1500.0, 0.0)
    assert routes.reaches(behind)
    assert routes.reaches(beyond)
    floor.clear_footprint(Pose())
    assert not _solid_on(floor, routes.route_to(behind))
    assert not _solid_on(floor, routes.route_to(beyond))


def test_a_place_in_the_present_cell_is_reached_at_once():
    routes = PathPlanner(_room(), (10.0, 10.0), SPEED_MM_S)
    assert routes.route_to((30.0, 40.0)) == ((30.0, 40.0),)
    assert routes.seconds_to(np.array([(30.0, 40.0)]))[0] == 0.0


DISCS = st.lists(
    st.tuples(st.floats(-1900.0, 1900.0), st.floats(-1900.0, 1900.0), st.floats(60.0, 500.0)), max_size=8
).map(lambda discs: [(x, y, radius) for x, y, radius in discs if math.hypot(x, y) > radius + 250.0])
# not on the border of two cells, of which rounding may take the other one
GOALS = st.tuples(*[st.integers(-1900, 1899).map(lambda mm: mm + 0.5)] * 2)


@pytest.mark.slow
@given(discs=DISCS, goal=GOALS)
@example(discs=[(46.0, -882.0, 249.0), (-364.0, -420.0, 297.0)], goal=(-160.5, -820.5))  # beside a solid cell's corner
def test_the_straight_legs_of_a_way_cross_nothing_solid(discs, goal):
    floor = _with_discs(discs)
    routes = PathPlanner(floor, START, SPEED_MM_S)
    assume(routes.reaches(goal))
    route = routes.route_to(goal)
    assert route[-1] == goal
    assert not _solid_on(floor, route)


@given(discs=DISCS, goal=GOALS)
def test_a_path_is_never_quicker_than_the_straight_line_nor_much_longer_than_its_time_says(discs, goal):
    routes = PathPlanner(_with_discs(discs), START, SPEED_MM_S)
    assume(routes.reaches(goal))
    (seconds,) = routes.seconds_to(np.array([goal]))
    assert seconds * SPEED_MM_S >= math.dist(START, goal) - 2 * CELL_MM
    assert _route_mm(routes.route_to(goal)) <= 1.05 * seconds * SPEED_MM_S + 3 * CELL_MM


@given(discs=DISCS, known=st.booleans())
def test_places_can_be_reached(discs, known):
    floor = _with_discs(discs)
    routes = PathPlanner(floor, START, SPEED_MM_S)
    places = routes.reachable_places(400.0, known=known)
    assert len(places) >= 1
    assert np.isfinite(routes.seconds_to(places)).all()
    assert all(floor.log_odds[CELLS.at(x_mm, y_mm)] <= SOLID for x_mm, y_mm in places)
    if known:
        assert all(floor.log_odds[CELLS.at(x_mm, y_mm)] < 0.0 for x_mm, y_mm in places)


def test_unknown_floor_before_an_opening_may_be_gone_to_and_what_lies_behind_a_wall_may_not():
    floor = _room()
    door = (X_MM > 0.0) & (np.abs(Y_MM) < 400.0) & (X_MM >= HALF_ROOM_MM - CELL_MM)
    floor.log_odds[door] = 0.0
    floor.log_odds[floor.log_odds == MAX_LOG_ODDS] = 0.5
    places = PathPlanner(floor, START, SPEED_MM_S).reachable_places(CELL_MM, known=True)
    assert places[:, 0].max() > HALF_ROOM_MM + 100.0
    assert places[:, 0].max() < HALF_ROOM_MM + 500.0
    assert places[:, 0].min() > -HALF_ROOM_MM
