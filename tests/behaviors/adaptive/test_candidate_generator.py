"""Candidates on maps drawn by hand: detours, viewpoints, and other targets that take less time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from behaviors.adaptive.candidate_generator import CandidateGenerator
from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.grid_tuning import MAX_LOG_ODDS, SOLID
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Event, Reason
from behaviors.failures import Failure, TargetFinding
from behaviors.mission import AdaptiveParameters, Mission
from behaviors.ports import Glimpse, Point, Pose, Sighting

CELLS = Cells()

PROFILE = AdaptiveParameters()
X_MM, Y_MM = CELLS.centre_mm(np.arange(CELLS.side))[:, None], CELLS.centre_mm(np.arange(CELLS.side))[None, :]
DOOR, WINDOW = (1600.0, 0.0), (0.0, 1500.0)


def _world(**seen: Point) -> WorldModel:
    """A robot in the middle of a free room of four metres, which has seen these targets from where it stands."""
    world = WorldModel(
        Mission.model_validate(
            {
                "mission": {"targets": ["door", "window"]},
                "target": {name: {"detector": "marker", "id": i} for i, name in enumerate(("door", "window"))},
            }
        )
    )
    world.floor.log_odds[np.maximum(np.abs(X_MM), np.abs(Y_MM)) < 2000.0] = -1.0
    for name, (x_mm, y_mm) in seen.items():
        bearing_deg, distance_mm = math.degrees(math.atan2(y_mm, x_mm)), math.hypot(x_mm, y_mm)
        sighting = Sighting(name, bearing_deg, distance_mm, 1.0, 0.0, (100, 80, 40, 56))
        world.perceive(0.0, Pose(), None, [name], Glimpse(0.0, {name: sighting}))
    return world


def _wall(world: WorldModel, x_mm: tuple[float, float], y_mm: tuple[float, float]) -> None:
    world.floor.log_odds[_within(X_MM, x_mm) & _within(Y_MM, y_mm)] = MAX_LOG_ODDS


def _within(values: NDArray[np.float64], limits: tuple[float, float]) -> NDArray[np.bool_]:
    return (values >= limits[0]) & (values <= limits[1])


def _candidates(world: WorldModel) -> CandidateGenerator:
    world.plan()
    return CandidateGenerator(world, PROFILE)


def test_a_target_that_was_seen_costs_the_way_there_and_its_chance_fades():
    (near,) = _candidates(_world(window=WINDOW)).others(["window"], 30.0)
    assert (near.target, near.age_s) == ("window", 30.0)
    assert 1500.0 / PROFILE.cruise_mm_s <= near.travel_s <= 1500.0 / PROFILE.cruise_mm_s + 3.0
    (later,) = _candidates(_world(window=WINDOW)).others(["window"], 90.0)
    assert 0.0 < later.chance < near.chance < 1.0


def test_a_target_that_was_not_seen_is_not_a_candidate():
    assert _candidates(_world(window=WINDOW)).others(["door"], 0.0) == ()


def test_a_target_behind_something_costs_the_way_round():
    world = _world(window=WINDOW)
    (straight,) = _candidates(world).others(["window"], 0.0)
    _wall(world, (-500.0, 500.0), (500.0, 600.0))
    (round_it,) = _candidates(world).others(["window"], 0.0)
    assert round_it.travel_s > straight.travel_s + 1.0


def test_a_target_without_a_path_is_not_a_candidate():
    world = _world(window=WINDOW)
    _wall(world, (-8000.0, 8000.0), (500.0, 700.0))
    assert _candidates(world).others(["window"], 0.0) == ()


def test_a_path_round_leads_to_where_the_straight_path_is_free():
    world = _world(door=DOOR)
    _wall(world, (700.0, 800.0), (-350.0, 350.0))
    detour = _candidates(world).detour("door")
    assert detour is not None
    assert world.floor.clear_between(detour.route[-1], DOOR, 330.0)
    assert detour.extra_s > 0.0


def test_a_path_round_says_how_much_unknown_floor_it_crosses():
    world = _world(door=DOOR)
    _wall(world, (700.0, 800.0), (-350.0, 350.0))
    known = _candidates(world).detour("door")
    world.floor.log_odds[np.abs(world.floor.log_odds) < MAX_LOG_ODDS] = 0.0  # only the wall is known
    world.plan()
    unknown = _candidates(world).detour("door")
    assert known is not None
    assert unknown is not None
    assert known.unknown_mm < 100.0
    assert unknown.unknown_mm > 800.0


@pytest.mark.parametrize("target", ["door", "window"])
def test_there_is_no_path_round_to_what_was_not_seen_or_is_shut_off(target):
    world = _world(door=DOOR)
    _wall(world, (700.0, 900.0), (-8000.0, 8000.0))
    assert _candidates(world).detour(target) is None


def test_a_robot_that_is_walled_in_doubts_its_map():
    world = _world(door=DOOR)
    for x_mm, y_mm in (
        ((-500, 500), (-500, -400)),
        ((-500, 500), (400, 500)),
        ((-500, -400), (-500, 500)),
        ((400, 500), (-500, 500)),
    ):
        _wall(world, x_mm, y_mm)
    candidates = _candidates(world)
    assert (world.floor.log_odds <= 0.0).all()
    assert candidates.viewpoints("window")


def test_places_to_look_from_lie_on_free_floor_and_the_most_promising_for_its_time_is_first():
    world = _world(door=DOOR)
    views = _candidates(world).viewpoints("window")
    worth = [view.chance / view.seconds for view in views]
    assert worth == sorted(worth, reverse=True)
    assert all(max(map(abs, view.route[-1])) < 2000.0 for view in views)
    assert all(0.0 <= view.chance <= 1.0 for view in views)


def test_after_a_room_was_seen_the_robot_looks_from_its_doorway():
    world = _world()
    edge = (np.maximum(np.abs(X_MM), np.abs(Y_MM)) >= 2000.0) & (np.maximum(np.abs(X_MM), np.abs(Y_MM)) < 2200.0)
    world.floor.log_odds[edge & ~((X_MM > 0.0) & (np.abs(Y_MM) < 450.0))] = SOLID - 0.1
    for x_mm, y_mm in ((0.0, 0.0), (-1000.0, 0.0), (800.0, 1000.0), (800.0, -1000.0)):
        for heading_deg in range(0, 360, 10):
            world.perceive(0.0, Pose(x_mm, y_mm, heading_deg), None, ["door"], Glimpse(0.0, {}), sonar_works=False)
        world.learn("door", Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN, finding=TargetFinding.NOT_HERE), 0.0)
    world.floor.without_sonar = False
    best, *_ = _candidates(world).viewpoints("door")
    x_mm, y_mm = best.route[-1]
    assert x_mm > 1700.0
    assert abs(y_mm) < 450.0


def test_a_place_that_shows_the_target_and_some_of_what_is_beyond_it_is_no_more_than_certain(mocker):
    world = _world()
    mocker.patch.object(
        world.targets, "chances_from", side_effect=lambda _target, places: [(0.95, 0.9) for _ in places]
    )
    gains = _candidates(world).gains("door")
    assert len(gains) > 3
    assert 0.9 < max(gain.chance for gain in gains) <= 1.0
