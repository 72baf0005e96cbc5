"""The occupancy grid: echoes and bumps mark and clear cells, and marks decay."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.grid_cells import CELL_MM, Cells
from behaviors.adaptive.grid_tuning import (
    APPEARED_DECAY_S,
    DECAY_S,
    EXPLAINING_LOG_ODDS,
    HINT,
    MAX_LOG_ODDS,
    MAX_SIDE,
    MIN_LOG_ODDS,
    NEAR_MM,
    SOLID,
)
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.visible_floor import VisibleFloor
from behaviors.ports import Pose

CELLS = Cells()

ORIGIN = Pose()
OUTSIDE_MM = MAX_SIDE * CELL_MM / 2
FARTHEST_ECHO_MM = 2550.0
POSES = st.builds(Pose, *[st.floats(-1.5 * OUTSIDE_MM, 1.5 * OUTSIDE_MM)] * 2, st.floats(-1000.0, 1000.0))


def _evidence_at(floor: OccupancyGrid, x_mm: float, y_mm: float) -> float:
    return float(floor.log_odds[floor.cells.at(x_mm, y_mm)])


def _listen(floor: OccupancyGrid, range_mm: float, times: int = 6, at: Pose = ORIGIN) -> tuple[float, float]:
    """Hear the same thing several times while moving to and fro a little.

    Returns:
        Where it is.
    """
    for i in range(times):
        back_mm = 40.0 * (i % 2)
        here = at.ahead(-back_mm)
        floor.add_echo(Pose(*here, at.heading_deg), range_mm + back_mm)
    return at.ahead(100.0 + range_mm)


def test_echoes_from_near_mark_what_they_hit():
    floor = OccupancyGrid()
    assert _evidence_at(floor, *_listen(floor, 0.7 * NEAR_MM)) > SOLID


def test_one_echo_is_not_yet_accepted_and_its_repetition_adds_nothing_new():
    floor = OccupancyGrid()
    for _ in range(10):
        floor.add_echo(ORIGIN, 500.0)
    assert HINT < _evidence_at(floor, 600.0, 0.0) <= SOLID


def test_echoes_from_afar_only_hint():
    floor = OccupancyGrid()
    place = _listen(floor, NEAR_MM + 500.0, times=50)
    assert HINT < _evidence_at(floor, *place) < SOLID


def test_a_far_echo_does_not_come_from_where_another_one_passed():
    """A doorway stays open when the beam meets one of its edges."""
    floor = OccupancyGrid()
    range_mm = NEAR_MM + 400.0
    _listen(floor, range_mm + 600.0)
    through = _evidence_at(floor, 100.0 + range_mm, 0.0)
    turned = Pose(heading_deg=10.0)
    _listen(floor, range_mm, at=turned)
    assert through < 0.0
    assert _evidence_at(floor, 100.0 + range_mm, 0.0) <= through + 1e-6
    assert _evidence_at(floor, *turned.ahead(100.0 + range_mm)) <= 0.0, "within the beam that passed"
    assert _evidence_at(floor, *Pose(heading_deg=19.0).ahead(100.0 + range_mm)) > HINT


def test_a_far_echo_comes_from_what_is_known_to_stand_on_its_arc():
    """Heard along a wall, it does not close the corridor beside it."""
    floor, range_mm = OccupancyGrid(), NEAR_MM + 500.0
    wall = Pose(heading_deg=10.0).ahead(100.0 + range_mm)
    floor.log_odds[floor.cells.at(*wall)] = EXPLAINING_LOG_ODDS + 0.1
    _listen(floor, range_mm, times=20)
    assert _evidence_at(floor, *wall) > EXPLAINING_LOG_ODDS + 0.1
    assert _evidence_at(floor, 100.0 + range_mm, 0.0) == 0.0
    assert _evidence_at(floor, *Pose(heading_deg=-10.0).ahead(100.0 + range_mm)) == 0.0


def test_something_new_within_a_free_beam_is_marked():
    floor = OccupancyGrid()
    range_mm = NEAR_MM + 400.0
    _listen(floor, range_mm + 600.0)
    assert _evidence_at(floor, *_listen(floor, range_mm, times=30)) > HINT


def test_an_echo_frees_the_beam_before_it_and_nothing_behind_it():
    floor = OccupancyGrid()
    _listen(floor, 600.0)
    assert _evidence_at(floor, 400.0, 0.0) < 0.0
    assert _evidence_at(floor, 400.0, 50.0) < 0.0
    assert _evidence_at(floor, 1000.0, 0.0) == 0.0
    assert _evidence_at(floor, 400.0, 400.0) == 0.0, "beside the beam"


def test_a_free_beam_clears_what_has_left():
    floor = OccupancyGrid()
    floor.mark_obstacle(ORIGIN, 300.0)
    assert floor.log_odds.max() > SOLID
    for heading_deg in range(-60, 61, 2):
        for back_mm in (0.0, 40.0, 80.0):
            floor.add_echo(Pose(-back_mm, 0.0, heading_deg), FARTHEST_ECHO_MM)
    assert floor.log_odds.max() < HINT


@pytest.mark.parametrize(
    ("turned_deg", "stays"), [(0.0, False), (30.0, False), (70.0, True), (110.0, True), (180.0, False)]
)
def test_a_beam_that_strikes_a_wall_at_a_glance_does_not_clear_it(turned_deg, stays):
    """It is deflected, and the echo comes from farther away."""
    floor = OccupancyGrid()
    wall = _listen(floor, 500.0)
    for beside_mm in (0.0, 40.0, -40.0) * 8:
        heading_deg = turned_deg + beside_mm / 40.0
        towards = Pose(*wall, heading_deg + 180.0).ahead(500.0)
        floor.add_echo(Pose(*towards, heading_deg), FARTHEST_ECHO_MM)
    assert (_evidence_at(floor, *wall) > SOLID) is stays


def test_an_echo_from_too_far_marks_nothing():
    floor = OccupancyGrid()
    _listen(floor, FARTHEST_ECHO_MM)
    assert floor.log_odds.max() == 0.0


def test_beside_the_beam_nothing_is_marked():
    floor = OccupancyGrid()
    place = _listen(floor, 600.0)
    assert _evidence_at(floor, *place) > SOLID
    for off_deg in (-25.0, 25.0):
        assert _evidence_at(floor, *Pose(100.0).ahead(600.0, off_deg)) == 0.0


@pytest.mark.parametrize("heading_deg", [0.0, 37.0, 90.0, 180.0, -135.0, 720.0 + 45.0])
def test_positive_is_right_in_the_map_too(heading_deg):
    floor = OccupancyGrid()
    _listen(floor, 500.0, at=Pose(300.0, -700.0, heading_deg))
    place = Pose(300.0, -700.0, heading_deg).ahead(600.0)
    marked = np.argwhere(floor.log_odds > SOLID)
    centre = (marked.mean(axis=0) - CELLS.side / 2 + 0.5) * CELL_MM
    assert math.dist(centre, place) < 1.5 * CELL_MM


def test_evidence_fades_to_about_a_third():
    floor = OccupancyGrid()
    place = _listen(floor, 500.0)
    floor.decay(0.0)
    before = floor.log_odds.copy()
    for now_s in np.arange(0.0, DECAY_S + 0.1, 0.5):
        floor.decay(float(now_s))
    assert _evidence_at(floor, *place) > 0.0
    np.testing.assert_allclose(floor.log_odds, before / math.e, rtol=0.02, atol=1e-3)


def test_what_appeared_where_the_floor_was_free_fades_sooner_than_what_stood_there():
    floor = OccupancyGrid()
    _listen(floor, 1200.0)
    floor.decay(0.0)
    floor.decay(2.0)
    floor.mark_obstacle(ORIGIN, 500.0)
    floor.mark_obstacle(Pose(heading_deg=90.0), 500.0)
    appeared, stood = (600.0, 0.0), (0.0, 600.0)
    assert _evidence_at(floor, *appeared) == _evidence_at(floor, *stood) > SOLID
    floor.decay(2.0 + APPEARED_DECAY_S)
    assert _evidence_at(floor, *appeared) < SOLID < _evidence_at(floor, *stood)


@pytest.mark.parametrize(
    ("free_mm", "turned_deg", "appeared"),
    [
        pytest.param(1200.0, 0.0, True, id="the floor was free there and behind"),
        pytest.param(550.0, 0.0, False, id="the floor was free up to there only"),
        pytest.param(1200.0, 25.0, False, id="one end of the arc was never free"),
        pytest.param(None, 0.0, False, id="nothing is known"),
    ],
)
def test_something_appeared_if_the_floor_was_free_all_along_its_arc_and_behind_it(free_mm, turned_deg, appeared):
    floor = OccupancyGrid()
    if free_mm is not None:
        _listen(floor, free_mm)
    floor.decay(0.0)
    floor.decay(2.0)
    assert floor.appeared(Pose(heading_deg=turned_deg), 500.0) is appeared


def test_what_was_taken_back_was_never_free():
    """A map drawn at wrong headings is no evidence of what has come since."""
    floor = OccupancyGrid()
    floor.decay(0.0)
    floor.save()
    _listen(floor, 1200.0)
    floor.decay(2.0)
    assert floor.appeared(ORIGIN, 500.0)
    floor.restore()
    assert not floor.appeared(ORIGIN, 500.0)
    assert not floor.log_odds.any()


def test_the_first_look_at_the_clock_fades_nothing():
    floor = OccupancyGrid()
    place = _listen(floor, 500.0)
    before = _evidence_at(floor, *place)
    floor.decay(1e6)
    assert _evidence_at(floor, *place) == before


def test_where_the_robot_stands_nothing_else_is():
    floor = OccupancyGrid()
    floor.mark_obstacle(ORIGIN, 0.0)
    floor.clear_footprint(ORIGIN)
    assert _evidence_at(floor, 0.0, 0.0) < 0.0
    assert _evidence_at(floor, 90.0, 0.0) < 0.0
    assert _evidence_at(floor, 250.0, 0.0) > SOLID


def test_an_obstacle_on_the_path_blocks_it():
    floor = OccupancyGrid()
    assert floor.clear_between((0.0, 0.0), (1500.0, 0.0))
    floor.mark_obstacle(ORIGIN, 500.0)
    assert not floor.clear_between((0.0, 0.0), (1500.0, 0.0))
    assert not floor.clear_between((1500.0, 0.0), (0.0, 0.0))
    assert not floor.clear_between((0.0, -150.0), (1500.0, 150.0))
    assert floor.blocked_after_mm((0.0, 0.0), (1500.0, 0.0)) == pytest.approx(600.0, abs=2 * CELL_MM)
    assert floor.clear_between((0.0, 0.0), (0.0, 1500.0))
    assert floor.clear_between((0.0, 600.0), (1500.0, 600.0))


def test_a_path_that_ends_in_front_of_the_obstacle_is_clear():
    floor = OccupancyGrid()
    floor.mark_obstacle(ORIGIN, 1000.0)
    assert floor.clear_between((0.0, 0.0), (1500.0, 0.0), standoff_mm=900.0)
    assert not floor.clear_between((0.0, 0.0), (1500.0, 0.0), standoff_mm=100.0)


@pytest.mark.parametrize("standoff_mm", [0.0, 300.0])
def test_no_way_at_all_is_clear(standoff_mm):
    floor = OccupancyGrid()
    floor.mark_obstacle(ORIGIN, 0.0)
    assert floor.clear_between((50.0, 50.0), (50.0, 50.0), standoff_mm)


@given(heading_deg=st.floats(0.0, 360.0), range_mm=st.floats(0.0, FARTHEST_ECHO_MM))
def test_what_is_out_of_the_grid_is_not_mapped(heading_deg, range_mm):
    floor, far_away = OccupancyGrid(), Pose(2 * OUTSIDE_MM, -2 * OUTSIDE_MM, heading_deg)
    floor.add_echo(far_away, range_mm)
    floor.mark_obstacle(far_away, range_mm)
    floor.clear_footprint(far_away)
    assert not floor.log_odds.any()
    assert floor.clear_between((2 * OUTSIDE_MM, 0.0), (0.0, 2 * OUTSIDE_MM))


def test_it_grows_to_where_there_is_something_and_keeps_its_contents():
    floor = OccupancyGrid()
    floor.mark_obstacle(ORIGIN, 1000.0)
    near = _evidence_at(floor, 1250.0, 0.0)
    floor.save()
    down_the_corridor = Pose(2.5 * CELLS.reach_mm, 0.0)
    for _ in range(2):
        floor.clear_footprint(down_the_corridor)
        floor.mark_obstacle(down_the_corridor, 500.0)
        assert near > SOLID
        assert _evidence_at(floor, 1250.0, 0.0) == near
        assert _evidence_at(floor, down_the_corridor.x_mm, 0.0) < 0.0
        assert floor.blocked_after_mm((down_the_corridor.x_mm, 0.0), down_the_corridor.ahead(1500.0)) is not None
        floor.restore()
        assert _evidence_at(floor, 1250.0, 0.0) == near
        assert _evidence_at(floor, down_the_corridor.x_mm, 0.0) == 0.0


@pytest.mark.parametrize("way", ["echo", "silence", "view"])
def test_it_grows_to_echoes_and_sightings(way):
    floor, edge = OccupancyGrid(), Pose(CELLS.reach_mm - 500.0, 0.0)
    match way:
        case "echo":
            floor.add_echo(edge, 1000.0)
        case "silence":
            floor.add_no_echo(edge)
        case _:
            bearing_deg, near_mm, far_mm = np.linspace(-20.0, 20.0, 41), np.full(41, 300.0), np.full(41, 1500.0)
            floor.add_view(edge, VisibleFloor(bearing_deg, near_mm, far_mm, far_mm, np.full(41, fill_value=True)))
    assert _evidence_at(floor, CELLS.reach_mm + 200.0, 0.0) < 0.0
    assert not floor.log_odds[[0, -1], :].any(), "nothing is pushed back to the edge"


ACTIONS = st.tuples(
    st.sampled_from(["echo", "echo", "echo", "block", "stand", "decay"]), POSES, st.floats(0.0, FARTHEST_ECHO_MM)
)


@given(actions=st.lists(ACTIONS, max_size=30))
def test_evidence_stays_within_its_bounds(actions):
    floor, now_s = OccupancyGrid(), 0.0
    for action, pose, range_mm in actions:
        match action:
            case "echo":
                floor.add_echo(pose, range_mm)
            case "block":
                floor.mark_obstacle(pose, range_mm)
            case "stand":
                floor.clear_footprint(pose)
            case _:
                now_s += range_mm / 100.0
                floor.decay(now_s)
    assert np.isfinite(floor.log_odds).all()
    assert floor.log_odds.max() <= MAX_LOG_ODDS
    assert floor.log_odds.min() >= MIN_LOG_ODDS


@pytest.mark.parametrize("range_mm", [FARTHEST_ECHO_MM, None])
def test_what_lies_behind_a_wall_that_deflects_a_beam_is_not_known_to_be_free(range_mm):
    floor = OccupancyGrid()
    wall = _listen(floor, 500.0)
    glancing = Pose(*Pose(*wall, -110.0).ahead(400.0), 70.0)
    for back_mm in (0.0, 40.0) * 6:
        here = Pose(*glancing.ahead(-back_mm), glancing.heading_deg)
        if range_mm is None:
            floor.add_no_echo(here)
        else:
            floor.add_echo(here, range_mm)
    assert _evidence_at(floor, *Pose(*wall, 70.0).ahead(-200.0)) < 0.0, "before it"
    assert _evidence_at(floor, *Pose(*wall, 70.0).ahead(300.0)) == 0.0
