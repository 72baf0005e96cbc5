"""Belief: how it changes with sightings, with looks without one, and with time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.belief import Belief, likely_places
from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.grid_tuning import MAX_LOG_ODDS, SOLID
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.ports import Point, Pose

CELLS = Cells()

RANGE_MM, HALF_VIEW_DEG = 3000.0, 25.0
TURN_DEG_S = 36.0
POSES = st.builds(Pose, *[st.floats(-8000.0, 8000.0)] * 2, st.floats(-1000.0, 1000.0))
POINTS = st.tuples(*[st.floats(-9000.0, 9000.0)] * 2)


def _belief() -> Belief:
    return Belief(RANGE_MM, HALF_VIEW_DEG, likely_places(OccupancyGrid()))


def _room() -> OccupancyGrid:
    """Free floor, 4 m square."""
    floor = OccupancyGrid()
    middle = np.abs(CELLS.centre_mm(np.arange(CELLS.side))) < 2000.0
    floor.log_odds[np.ix_(middle, middle)] = -1.0
    return floor


def _within(belief: Belief, place: Point, radius_mm: float) -> float:
    """Probability that it is so near to a place."""
    places = belief.by_place()
    axis_mm = np.linspace(-belief.reach_mm, belief.reach_mm, len(places))
    near = np.hypot(axis_mm[:, None] - place[0], axis_mm[None, :] - place[1]) <= radius_mm
    return float(places[near].sum())


def _ahead(belief: Belief, distance_mm: float = 1200.0) -> float:
    return _within(belief, (distance_mm, 0.0), 400.0)


def _behind(belief: Belief) -> float:
    return _within(belief, (-1200.0, 0.0), 400.0)


def _width_deg(arc: tuple[float, float]) -> float:
    return arc[1] - arc[0]


def _covers(arc: tuple[float, float], bearing_deg: float) -> bool:
    return (bearing_deg - arc[0]) % 360.0 <= _width_deg(arc)


def test_a_look_lowers_what_it_shows_and_raises_the_rest():
    belief = _belief()
    ahead, behind = _ahead(belief), _behind(belief)
    belief.look(Pose(), _room(), 3)
    assert _ahead(belief) < ahead
    assert _behind(belief) > behind


def test_what_lies_beyond_the_detectors_range_loses_nothing():
    belief = _belief()
    before = _ahead(belief, 4400.0)
    belief.look(Pose(), _room(), 10)
    assert _ahead(belief, 4400.0) > before


def test_near_places_lose_more_than_far_ones():
    belief = _belief()
    near, far = _ahead(belief, 800.0), _ahead(belief, 2700.0)
    belief.look(Pose(), _room(), 1)
    assert _ahead(belief, 800.0) / near < _ahead(belief, 2700.0) / far


def test_more_frames_are_stronger_evidence_but_never_rule_a_place_out():
    shares = []
    for frames in (1, 3, 100):
        belief = _belief()
        belief.look(Pose(), _room(), frames)
        shares.append(_ahead(belief, 2600.0))
    assert shares[0] > shares[1] > shares[2] > 0.0


def test_unknown_floor_opens_from_a_doorway_and_not_from_beside_a_wall():
    floor, belief = _room(), _belief()
    x_mm, y_mm = CELLS.centre_mm(np.arange(CELLS.side))[:, None], CELLS.centre_mm(np.arange(CELLS.side))[None, :]
    away_mm = np.maximum(np.abs(x_mm), np.abs(y_mm))
    door = (x_mm > 0.0) & (np.abs(y_mm) < 400.0)
    floor.log_odds[(away_mm > 2000.0) & (away_mm < 2150.0) & ~door] = MAX_LOG_ODDS
    before_it, beside_it = belief.frontier_chances_from([(1900.0, 0.0), (1900.0, 1200.0)], floor)
    assert before_it > 3 * beside_it


def test_what_is_hidden_behind_something_loses_less():
    wall = _room()
    wall.log_odds[
        (CELLS.centre_mm(np.arange(CELLS.side)) > 550.0) & (CELLS.centre_mm(np.arange(CELLS.side)) < 750.0), :
    ] = MAX_LOG_ODDS
    free, hidden = _belief(), _belief()
    free.look(Pose(), _room(), 3)
    hidden.look(Pose(), wall, 3)
    assert _ahead(hidden, 1800.0) > _ahead(free, 1800.0)


def test_a_wall_that_is_found_while_turning_on_the_spot_hides_what_is_behind_it():
    floor = _room()
    belief, informed = _belief(), _belief()
    belief.look(Pose(heading_deg=180.0), floor, 3)
    informed.look(Pose(heading_deg=180.0), floor, 3)
    floor.log_odds[
        (CELLS.centre_mm(np.arange(CELLS.side)) > 550.0) & (CELLS.centre_mm(np.arange(CELLS.side)) < 750.0), :
    ] = MAX_LOG_ODDS
    belief.look(Pose(), floor, 3)
    informed.chance_from(3000.0, 3000.0, floor)  # having been asked about somewhere else makes no difference
    informed.look(Pose(), floor, 3)
    assert _ahead(belief, 1800.0) == pytest.approx(_ahead(informed, 1800.0))


def test_an_echo_counts_even_when_another_one_outweighs_it():
    def chance(*places: Point) -> float:
        """Of the last of several floors with one thing on each, asked one after the other."""
        belief, chances = _belief(), []
        for place in places:
            floor = _room()
            floor.log_odds[CELLS.at(*place)] = MAX_LOG_ODDS
            chances.append(belief.chance_from(0.0, 0.0, floor))
        return chances[-1]

    moved, fresh = chance((400.0, 0.0), (1600.0, 1600.0)), chance((1600.0, 1600.0))
    assert moved == fresh
    assert chance((400.0, 0.0)) != fresh


def test_a_sighting_concentrates_belief_where_it_was():
    belief, place = _belief(), (1300.0, -700.0)
    belief.see(place, (0.0, 0.0))
    assert _within(belief, place, 400.0) > 0.8
    assert belief.chance_from(300.0, 0.0, _room()) > belief.chance_from(-1700.0, 1500.0, _room())


def test_a_sighting_shows_from_which_side_the_target_can_be_seen():
    belief, place = _belief(), (1000.0, 0.0)
    belief.see(place, (0.0, 0.0))
    floor = _room()
    assert belief.chance_from(100.0, 0.0, floor) > 2 * belief.chance_from(1900.0, 0.0, floor)


def test_a_narrow_sighting_leaves_two_ways_it_may_face_until_it_is_seen_from_elsewhere():
    belief, place = _belief(), (1000.0, 0.0)
    aside = np.array([(1000.0, 800.0), (1000.0, -800.0)])
    belief.see(place, (0.0, 0.0), slant_deg=50.0)
    right, left = belief.faces(place, aside)
    assert right == pytest.approx(left, abs=0.05)
    belief.see(place, (400.0, 500.0), slant_deg=10.0)
    right, left = belief.faces(place, aside)
    assert right > 2 * left


def test_looks_from_several_places_refute_a_sighting():
    belief, place = _belief(), (1200.0, 0.0)
    belief.see(place, (0.0, 0.0))
    for y_mm in (0.0, 500.0, -500.0, 250.0, -250.0):
        belief.look(Pose(0.0, y_mm, -math.degrees(math.atan2(y_mm, place[0]))), _room(), 10)
    assert _within(belief, place, 300.0) < 0.1


def test_looks_before_a_sighting_do_not_weaken_those_after_it():
    """It was overlooked, then seen, and now it is gone: each change shows, although the robot never moved."""
    belief, floor, place = _belief(), _room(), (1200.0, 0.0)
    belief.look(Pose(), floor, 50)
    belief.see(place, (0.0, 0.0))
    seen = _within(belief, place, 300.0)
    belief.look(Pose(), floor, 50)
    assert _within(belief, place, 300.0) < 0.8 * seen


def test_what_was_looked_at_long_ago_is_worth_another_look():
    belief, floor = _belief(), _room()
    belief.look(Pose(), floor, 50)
    belief.decay(5000.0)
    renewed = _ahead(belief)
    belief.look(Pose(), floor, 50)
    assert _ahead(belief) < 0.8 * renewed


def test_a_room_not_seen_yet_is_a_better_place_to_look_in_than_one_seen_two_minutes_ago():
    floor = OccupancyGrid()
    along, across = CELLS.centre_mm(np.arange(CELLS.side)), np.abs(CELLS.centre_mm(np.arange(CELLS.side))) < 1500.0
    floor.log_odds[np.ix_((along > -1500.0) & (along < 6500.0), across)] = -1.0
    floor.log_odds[np.ix_((along > 2000.0) & (along < 2200.0), across)] = SOLID + 1.0  # the door is shut by now
    belief = _belief()
    belief.follow(likely_places(floor))
    for heading_deg in range(0, 360, 20):
        belief.look(Pose(0.0, 0.0, heading_deg), floor, 3)
    for _ in range(24):
        belief.decay(5.0)
    assert belief.chance_from(4500.0, 0.0, floor) > belief.chance_from(-800.0, 500.0, floor)


def test_refuting_a_place_clears_it():
    belief, place = _belief(), (1300.0, -700.0)
    belief.see(place, (0.0, 0.0))
    belief.refute(place)
    assert _within(belief, place, 300.0) < 0.3
    assert 0.0 < belief.chance_from(300.0, 0.0, _room()) < 0.5


@pytest.mark.parametrize("bearing_deg", [0.0, 50.0, 135.0, 180.0, 260.0, 355.0])
def test_the_arc_covers_where_the_target_was_seen(bearing_deg):
    belief, floor = _belief(), _room()
    belief.see(Pose().ahead(1300.0, bearing_deg), (0.0, 0.0))
    arc = belief.arc_from(0.0, 0.0, floor, TURN_DEG_S)
    assert _covers(arc, bearing_deg)
    assert _width_deg(arc) <= 120.0


def test_the_arc_is_nearly_the_whole_turn_without_knowledge():
    assert _width_deg(_belief().arc_from(0.0, 0.0, OccupancyGrid(), TURN_DEG_S)) >= 300.0


def test_the_arc_leaves_out_what_was_looked_at():
    belief, floor = _belief(), _room()
    for heading_deg in range(-60, 61, 10):
        belief.look(Pose(heading_deg=heading_deg), floor, 5)
    arc = belief.arc_from(0.0, 0.0, floor, TURN_DEG_S)
    assert _covers(arc, 180.0)
    assert not _covers(arc, 0.0)


def test_a_viewpoint_nearer_to_the_mass_has_the_greater_chance():
    belief, floor = _belief(), OccupancyGrid()
    belief.see((3200.0, 0.0), (0.0, 0.0))
    chances = [belief.chance_from(x_mm, 0.0, floor) for x_mm in (-800.0, 300.0, 1200.0, 2000.0)]
    assert chances == sorted(chances)
    assert chances[0] < chances[-1] <= 1.0


def test_time_brings_belief_back_to_where_it_began():
    belief, fresh = _belief(), _belief()
    belief.see((1300.0, -700.0), (0.0, 0.0))
    belief.look(Pose(heading_deg=90.0), _room(), 5)
    distances = []
    for passed_s in (0.0, 100.0, 1e5):
        belief.decay(passed_s)
        distances.append(float(np.abs(belief.by_place() - fresh.by_place()).sum()))
    assert distances[0] > distances[1] > distances[2]
    assert distances[2] < 1e-9


ACTIONS = st.one_of(
    st.tuples(st.just("look"), POSES, st.integers(1, 200)),
    st.tuples(st.just("see"), POINTS, POINTS),
    st.tuples(st.just("refute"), POINTS),
    st.tuples(st.just("decay"), st.floats(0.0, 1000.0)),
    st.tuples(st.just("block"), POSES, st.floats(0.0, 2500.0)),
)


@given(actions=st.lists(ACTIONS, max_size=12), here=POINTS)
def test_belief_stays_a_probability(actions, here):
    belief, floor = _belief(), _room()
    for action, *values in actions:
        match action:
            case "look":
                belief.look(values[0], floor, values[1])
            case "block":
                floor.mark_obstacle(*values)
            case _:
                getattr(belief, action)(*values)
    assert belief.by_place().min() >= 0.0
    assert belief.by_place().sum() == pytest.approx(1.0)
    assert -1e-9 <= belief.chance_from(*here, floor) <= 1.0 + 1e-9
    begin_deg, end_deg = belief.arc_from(*here, floor, TURN_DEG_S)
    assert 0.0 < end_deg - begin_deg <= 360.0
    assert math.isfinite(begin_deg)


# a map that grows

BEYOND = (CELLS.reach_mm + 1000.0, 0.0)


def _grown(floor: OccupancyGrid) -> OccupancyGrid:
    floor.include(BEYOND)
    return floor


def test_more_places_are_as_likely_as_if_they_had_been_considered_from_the_start():
    late, early, floor = _belief(), _belief(), _room()
    late.follow(likely_places(floor))
    early.follow(likely_places(_grown(floor)))
    for belief in (late, early):
        belief.look(Pose(), floor, 3)
        belief.refute((1600.0, 800.0))
        belief.decay(60.0)
        belief.scatter()
        belief.look(Pose(heading_deg=120.0), floor, 3)
    late.follow(likely_places(floor))
    small, large = late.by_place(), early.by_place()
    np.testing.assert_allclose(small, large, rtol=0.05)
    for belief in (late, early):
        belief.look(Pose(heading_deg=120.0), floor, 6)  # from the same place: what it hid then it hides now
    np.testing.assert_allclose(late.by_place(), early.by_place(), rtol=0.05)


def test_a_target_is_likelier_where_there_is_floor():
    belief, floor = _belief(), _room()
    before = _within(belief, (4000.0, 0.0), 800.0)
    corridor = np.ix_(np.abs(CELLS.centre_mm(np.arange(CELLS.side)) - 3500.0) < 1600.0, range(85, 95))
    floor.log_odds[corridor] = -1.0
    belief.follow(likely_places(floor))
    assert _within(belief, (4000.0, 0.0), 800.0) > 1.2 * before
    assert _within(belief, (4000.0, 0.0), 800.0) > 1.2 * _within(belief, (-4000.0, 0.0), 800.0)
    assert belief.by_place().sum() == pytest.approx(1.0)


def test_what_was_looked_for_in_vain_stays_unlikely_whatever_the_map_shows():
    belief, floor = _belief(), _room()
    belief.follow(likely_places(floor))
    for _ in range(5):
        belief.look(Pose(), floor, 6)
    before = _ahead(belief) / _behind(belief)
    belief.follow(likely_places(_grown(floor)))
    assert _ahead(belief) / _behind(belief) == pytest.approx(before)


def test_a_target_can_be_beyond_where_the_map_began():
    belief, floor = _belief(), _grown(_room())
    belief.follow(likely_places(floor))
    belief.see(BEYOND, (CELLS.reach_mm - 1000.0, 0.0))
    assert belief.held_at(BEYOND) > 0.8
    assert belief.chance_from(CELLS.reach_mm - 1000.0, 0.0, floor) > 0.3
