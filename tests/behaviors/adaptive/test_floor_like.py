"""What stands on the floor in the floor's colours: the camera shows only its direction, and views from several places
together show where it is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from behaviors.adaptive.grid_tuning import HINT, MAX_LOG_ODDS, SOLID
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.visible_floor import FloorRanges, VisibleFloor
from behaviors.mission.robot import CameraTable
from behaviors.ports import FloorRay, Point, Pose

BEARINGS = np.linspace(-28.0, 28.0, 24)
WALL_MM = 2600.0
BOX, HALF_MM = (1420.0, 20.0), 100.0
"""A box on the floor in front of a wall, and half its width."""


def _ranges(*, calibrated: bool) -> FloorRanges:
    return FloorRanges(CameraTable(height_mm=200.0), 60.0, 15.0, calibrated=calibrated)


def _view(pose: Pose, *, walls_are_floor_like: bool = False) -> VisibleFloor:
    """What an exactly known camera sees of the box and the wall at x = 2600 mm."""
    bearing_deg, away_mm = pose.polar_to(BOX)
    hidden = np.abs(BEARINGS - bearing_deg) <= math.degrees(math.atan2(HALF_MM, away_mm))
    alike = np.full(len(BEARINGS), True) if walls_are_floor_like else hidden
    bearings, end_mm = BEARINGS[~alike], WALL_MM / np.cos(np.radians(BEARINGS[~alike] + pose.heading_deg))
    each = np.ones(len(bearings))
    return VisibleFloor(
        bearings, 460.0 * each, end_mm, end_mm, each > 0, BEARINGS[alike], np.full(np.count_nonzero(alike), 460.0)
    )


def _evidence_at(floor: OccupancyGrid, place: Point) -> float:
    return float(floor.log_odds[floor.cells.at(*place)])


def _look_from(floor: OccupancyGrid, *places: Point, walls_are_floor_like: bool = False) -> None:
    """Look towards the box from some places, ten times from each while moving a little."""
    for x_mm, y_mm in places:
        for i in range(10):
            at = Pose(x_mm, y_mm + 40.0 * (i % 2))
            heading_deg, _ = at.polar_to(BOX)
            pose = Pose(at.x_mm, at.y_mm, heading_deg)
            floor.add_view(pose, _view(pose, walls_are_floor_like=walls_are_floor_like))


def test_from_one_place_it_may_stand_anywhere_on_the_ray():
    floor = OccupancyGrid()
    _look_from(floor, (0.0, 0.0))
    along = [_evidence_at(floor, (x_mm, 20.0)) for x_mm in (700.0, 1420.0, 2000.0)]
    assert all(0.0 < evidence < SOLID for evidence in along)
    assert _evidence_at(floor, (1420.0, 500.0)) < -HINT, "the floor beside it is seen to be free"


def test_turning_on_the_spot_shows_nothing_new_of_it():
    floor = OccupancyGrid()
    for heading_deg in range(-60, 61, 3):
        floor.add_view(Pose(heading_deg=heading_deg), _view(Pose(heading_deg=heading_deg)))
    assert max(_evidence_at(floor, (x_mm, 20.0)) for x_mm in range(500, 2500, 80)) < HINT
    before = floor.log_odds.max()
    for heading_deg in range(-60, 61, 3):
        floor.add_view(Pose(heading_deg=heading_deg), _view(Pose(heading_deg=heading_deg)))
    assert floor.log_odds[floor.cells.at(*BOX)] <= before


def test_views_from_several_places_show_where_it_stands():
    floor = OccupancyGrid()
    _look_from(floor, (0.0, 0.0), (500.0, -900.0), (500.0, 900.0))
    assert HINT < _evidence_at(floor, BOX) < SOLID
    assert all(_evidence_at(floor, (x_mm, 20.0)) < HINT for x_mm in (800.0, 1000.0, 2000.0))


def test_it_is_never_certain_and_takes_nothing_from_what_is():
    floor = OccupancyGrid()
    _look_from(floor, *[(0.0, y_mm) for y_mm in range(-900, 901, 100)] * 3)
    assert HINT < _evidence_at(floor, BOX) < SOLID
    floor.log_odds[floor.cells.at(*BOX)] = MAX_LOG_ODDS
    _look_from(floor, (300.0, 0.0))
    assert _evidence_at(floor, BOX) == MAX_LOG_ODDS


def test_nothing_is_suspected_behind_an_obstacle_on_the_map():
    known, unknown = OccupancyGrid(), OccupancyGrid()
    window, inside = known.cells.disc(*BOX, HALF_MM)
    known.log_odds[window][inside] = MAX_LOG_ODDS
    for floor in (known, unknown):
        _look_from(floor, (0.0, 0.0))
    assert 0.0 < _evidence_at(known, (2000.0, 20.0)) < _evidence_at(unknown, (2000.0, 20.0)) / 3


def test_where_every_wall_looks_like_the_floor_little_is_suspected():
    floor = OccupancyGrid()
    places = [(0.0, 0.0), (500.0, -900.0), (500.0, 900.0)]
    _look_from(floor, *places, walls_are_floor_like=True)
    assert floor.log_odds.max() < HINT


@pytest.mark.parametrize(("calibrated", "end_deg", "alike"), [(False, -2.0, 0), (False, -8.0, 1), (True, -2.0, 1)])
def test_a_camera_whose_tilt_nobody_measured_may_see_the_floor_end_just_above_the_horizon(calibrated, end_deg, alike):
    view = _ranges(calibrated=calibrated).measure([FloorRay(3.0, 23.0, end_deg), FloorRay(0.0, 23.0, 6.0)])
    assert view.bearing_deg.tolist() == [0.0]
    assert view.floor_like_deg.tolist() == [3.0] * alike
    assert view.floor_like_near_mm == pytest.approx(200.0 / math.tan(math.radians(23.0)))


def test_what_ends_at_the_horizon_but_for_the_tilt_that_was_learned_is_free_floor():
    ranges = _ranges(calibrated=False)
    for i in range(30):  # the camera looks down by three degrees
        ranges.compare([FloorRay(0.0, 23.0, 11.5 + 3.0)] * 3, Pose(x_mm=200.0 * i), 983.0 - 60.0)
    view = ranges.measure([FloorRay(0.0, 23.0, 2.8)])
    assert view.free_mm > 1000.0
    assert not len(view.floor_like_deg)


def test_an_echo_is_not_compared_with_what_ends_above_the_horizon():
    ranges = _ranges(calibrated=False)
    rays = [FloorRay(float(each), 23.0, -1.0) for each in BEARINGS]
    for i in range(30):
        ranges.compare(rays, Pose(x_mm=200.0 * i), 1000.0)
    assert ranges.measure([FloorRay(0.0, 23.0, 14.0)]).end_mm == pytest.approx(200.0 / math.tan(math.radians(14.0)))
