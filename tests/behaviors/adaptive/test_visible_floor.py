"""The floor that a camera sees: how far it is free, how accurate that is, and how it changes the map."""

from __future__ import annotations

import math
from dataclasses import astuple
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.grid_tuning import APPEARED_DECAY_S, HINT, MAX_LOG_ODDS, MIN_LOG_ODDS, SOLID
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.visible_floor import FloorRanges, VisibleFloor
from behaviors.mission.robot import CameraTable
from behaviors.ports import FloorRay, Pose

CELLS = Cells()

HEIGHT_MM = 200.0
SONAR_AHEAD_MM = 60.0
BEAM_DEG = 15.0
NEAR_DEG = 23.0
BEARINGS = np.linspace(-28.0, 28.0, 24)


def _ranges(*, calibrated: bool = False, beam_deg: float = BEAM_DEG) -> FloorRanges:
    return FloorRanges(CameraTable(height_mm=HEIGHT_MM), SONAR_AHEAD_MM, beam_deg, calibrated=calibrated)


def _angle_deg(distance_mm: float) -> float:
    return math.degrees(math.atan2(HEIGHT_MM, distance_mm))


def _wall(ahead_mm: float, *, tilt_deg: float = 0.0, scale: float = 1.0) -> list[FloorRay]:
    """A wall right ahead of a camera that looks up by `tilt_deg`, unknown to the robot."""
    return [
        FloorRay(float(each), NEAR_DEG, (_angle_deg(ahead_mm / math.cos(math.radians(each))) - tilt_deg) / scale)
        for each in BEARINGS
    ]


def _learn(ranges: FloorRanges, *, tilt_deg: float, scale: float = 1.0) -> None:
    """Drive up to walls again and again."""
    for i, ahead_mm in enumerate((1500.0, 1200.0, 900.0, 700.0, 500.0) * 6):
        pose = Pose(x_mm=200.0 * i)
        ranges.compare(_wall(ahead_mm, tilt_deg=tilt_deg, scale=scale), pose, ahead_mm - SONAR_AHEAD_MM)


def _ahead(values: np.ndarray) -> float:
    return float(values[len(values) // 2])


@pytest.mark.parametrize("ahead_mm", [500.0, 800.0, 1200.0, 1900.0])
def test_an_angle_is_a_distance_on_the_floor(ahead_mm):
    view = _ranges(calibrated=True).measure(_wall(ahead_mm))
    assert _ahead(view.end_mm) == pytest.approx(ahead_mm, rel=0.01)
    assert 0.6 * ahead_mm < _ahead(view.free_mm) < ahead_mm
    assert view.near_mm == pytest.approx(HEIGHT_MM / math.tan(math.radians(NEAR_DEG)))


def test_a_camera_whose_tilt_nobody_measured_places_nothing_far_away():
    near, far = (_ranges().measure(_wall(ahead_mm)) for ahead_mm in (600.0, 2000.0))
    assert _ahead(near.end_mm) == pytest.approx(600.0, rel=0.01)
    assert math.isinf(_ahead(far.end_mm))
    assert 0.0 < _ahead(far.free_mm) < 1000.0, "but the floor is free as far as can be told"


@pytest.mark.parametrize("tilt_deg", [-5.0, 3.0])
@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_echoes_show_the_tilt_and_the_field_of_view_of_the_camera(tilt_deg, scale):
    ranges = _ranges()
    _learn(ranges, tilt_deg=tilt_deg, scale=scale)
    view = ranges.measure(_wall(1600.0, tilt_deg=tilt_deg, scale=scale))
    assert _ahead(view.end_mm) == pytest.approx(1600.0, rel=0.07)


def test_echoes_show_how_high_the_camera_is():
    """The mission does not say; it is mounted at 130 mm, not at the usual 200."""
    ranges = FloorRanges(CameraTable(), SONAR_AHEAD_MM, BEAM_DEG, calibrated=False)
    low = [
        (at, [FloorRay(0.0, 15.0, math.degrees(math.atan2(130.0, at)))] * 3) for at in (1400.0, 1000.0, 700.0, 500.0)
    ]
    for i, (at_mm, rays) in enumerate(low * 8):
        ranges.compare(rays, Pose(x_mm=200.0 * i), at_mm - SONAR_AHEAD_MM)
    for at_mm, rays in low:
        assert ranges.measure(rays).end_mm == pytest.approx(at_mm, rel=0.07)


def test_echoes_of_something_else_teach_nothing():
    ranges = _ranges(calibrated=True)
    for i in range(30):
        ranges.compare(_wall(700.0), Pose(x_mm=200.0 * i), 1400.0)  # a low box: the echo is of the wall behind it
    assert _ahead(ranges.measure(_wall(700.0)).end_mm) == pytest.approx(700.0, rel=0.01)


@pytest.mark.parametrize("seed", range(5))
def test_boxes_that_look_like_the_floor_teach_nothing(seed):
    """Three of five echoes come from a box somewhere before the wall at which the floor seems to end."""
    random, ranges = Random(seed), _ranges()
    for i in range(60):
        ahead_mm = random.uniform(700.0, 2000.0)
        echo_range_mm = random.uniform(500.0, ahead_mm) if random.random() < 0.6 else ahead_mm
        ranges.compare(_wall(ahead_mm), Pose(x_mm=200.0 * i), echo_range_mm - SONAR_AHEAD_MM)
    view = ranges.measure(_wall(1400.0))
    assert _ahead(view.end_mm) == pytest.approx(1400.0, rel=0.1)
    assert _ahead(view.free_mm) > 1000.0


def test_a_wall_is_compared_once_from_one_place():
    once, often = _ranges(), _ranges()
    once.compare(_wall(700.0, tilt_deg=2.0), Pose(), 700.0 - SONAR_AHEAD_MM)
    for _ in range(10):
        often.compare(_wall(700.0, tilt_deg=2.0), Pose(), 700.0 - SONAR_AHEAD_MM)
    assert _ahead(often.measure(_wall(700.0)).end_mm) == _ahead(once.measure(_wall(700.0)).end_mm)


def test_an_echo_is_compared_with_what_is_nearest_in_the_beam():
    ranges, post = _ranges(), _wall(1200.0)
    post[10:13] = [FloorRay(ray.bearing_deg, NEAR_DEG, _angle_deg(600.0)) for ray in post[10:13]]
    for i in range(10):
        ranges.compare(post, Pose(x_mm=200.0 * i), 600.0 - SONAR_AHEAD_MM)
    assert _ahead(ranges.measure(_wall(1600.0)).end_mm) == pytest.approx(1600.0, rel=0.05)


@pytest.mark.parametrize(("beam_deg", "in_it"), [(15.0, True), (7.0, False)])
def test_what_stands_beside_the_beam_of_this_sonar_is_not_in_it(beam_deg, in_it):
    """Posts 9 to 14 degrees to the side are nearer than the wall ahead, whose echo shows how the camera is tilted."""
    ranges = _ranges(beam_deg=beam_deg)
    for i, ahead_mm in enumerate((1500.0, 1200.0, 900.0) * 6):
        rays = _wall(ahead_mm, tilt_deg=4.0)
        rays[15:18] = [FloorRay(ray.bearing_deg, NEAR_DEG, _angle_deg(500.0) - 4.0) for ray in rays[15:18]]
        ranges.compare(rays, Pose(x_mm=200.0 * i), ahead_mm - SONAR_AHEAD_MM)
    learned_mm = _ahead(ranges.measure(_wall(1400.0, tilt_deg=4.0)).end_mm)
    assert (learned_mm == pytest.approx(1400.0, rel=0.07)) != in_it


def test_an_echo_received_after_a_turn_is_compared_where_it_came_from():
    ranges, off_deg = _ranges(), float(BEARINGS[17])
    for i, post_mm in enumerate((500.0, 700.0, 900.0, 1200.0) * 4):
        rays = _wall(2000.0, tilt_deg=4.0)
        rays[16:19] = [FloorRay(ray.bearing_deg, NEAR_DEG, _angle_deg(post_mm) - 4.0) for ray in rays[16:19]]
        ranges.compare(rays, Pose(x_mm=200.0 * i), post_mm - SONAR_AHEAD_MM, off_deg)
    assert _ahead(ranges.measure(_wall(1600.0, tilt_deg=4.0)).end_mm) == pytest.approx(1600.0, rel=0.07)


def test_a_robot_that_turns_places_far_things_roughly_and_sees_gaps_narrower():
    gap = [
        FloorRay(ray.bearing_deg, NEAR_DEG, _angle_deg(1900.0 if abs(ray.bearing_deg) < 8 else 1000.0))
        for ray in _wall(1000.0)
    ]
    ranges = _ranges(calibrated=True)
    still, turning = ranges.measure(gap), ranges.measure(gap, turn_deg_s=200.0)
    assert still.exact.all()
    assert not turning.exact[len(gap) // 2]
    assert (turning.free_mm > 1200.0).sum() < (still.free_mm > 1200.0).sum()


@given(st.lists(st.tuples(*[st.floats(-90, 90)] * 3), max_size=30), st.floats(-400, 400))
def test_whatever_the_rays_the_map_stays_sound(angles, turn_deg_s):
    view = _ranges().measure([FloorRay(*each) for each in angles], turn_deg_s)
    floor = OccupancyGrid()
    floor.add_view(Pose(), view, (Pose(), 500.0))
    assert np.isfinite(floor.log_odds).all()
    assert MIN_LOG_ODDS <= floor.log_odds.min() <= floor.log_odds.max() <= MAX_LOG_ODDS


# what the map makes of it


def _view(ahead_mm: float, *, exact: bool = True) -> VisibleFloor:
    """A wall right ahead, exactly known."""
    end_mm = ahead_mm / np.cos(np.radians(BEARINGS))
    return VisibleFloor(BEARINGS, np.full(len(BEARINGS), 460.0), end_mm, end_mm, np.full(len(BEARINGS), exact))


def _look(floor: OccupancyGrid, view: VisibleFloor, echo_range_mm: float | None = None, times: int = 6) -> None:
    """Look several times while moving to and fro across the view."""
    for i in range(times):
        pose = Pose(y_mm=40.0 * (i % 2))
        floor.add_view(pose, view, None if echo_range_mm is None else (pose, echo_range_mm))


def _evidence_at(floor: OccupancyGrid, x_mm: float, y_mm: float = 20.0) -> float:
    return float(floor.log_odds[CELLS.at(x_mm, y_mm)])


def test_what_is_seen_to_be_free_is_free_and_what_ends_the_floor_stands_there():
    floor = OccupancyGrid()
    _look(floor, _view(1000.0))
    assert _evidence_at(floor, 700.0) < -HINT
    assert _evidence_at(floor, 1015.0) > SOLID
    assert _evidence_at(floor, 1300.0) == 0.0
    assert _evidence_at(floor, 300.0) == 0.0, "below the frame"


def test_one_look_is_not_yet_accepted_and_its_repetition_adds_nothing_new():
    floor = OccupancyGrid()
    for _ in range(10):
        floor.add_view(Pose(), _view(1000.0))
    assert HINT < _evidence_at(floor, 1015.0) < SOLID


def test_a_view_from_where_an_undone_one_was_taken_counts():
    floor = OccupancyGrid()
    floor.add_view(Pose(), _view(1000.0))
    floor.restore()
    floor.add_view(Pose(), _view(1000.0))
    assert _evidence_at(floor, 1015.0) > HINT


def test_what_is_placed_roughly_only_hints():
    floor = OccupancyGrid()
    _look(floor, _view(1000.0, exact=False), times=20)
    assert HINT < _evidence_at(floor, 1015.0) < SOLID
    assert not floor.seen.any()


def test_an_echo_from_beyond_shows_that_a_rug_is_not_an_obstacle():
    floor = OccupancyGrid()
    _look(floor, _view(800.0), echo_range_mm=1900.0)
    assert _evidence_at(floor, 815.0) <= 0.0
    assert _evidence_at(floor, *Pose(heading_deg=25.0).ahead(800.0 / math.cos(math.radians(25.0)) + 15.0)) > SOLID


def test_what_returns_echoes_but_looks_like_floor_stays_on_the_map():
    floor, unseen = OccupancyGrid(), _view(2500.0)
    for i in range(6):
        pose = Pose(y_mm=40.0 * (i % 2))
        floor.add_view(pose, unseen, (pose, 500.0))
        floor.add_echo(pose, 500.0)
    evidence = _evidence_at(floor, 600.0)
    assert evidence > SOLID
    _look(floor, unseen, times=10)  # from here on without an echo
    assert _evidence_at(floor, 600.0) == evidence
    assert _evidence_at(floor, *Pose(heading_deg=20.0).ahead(600.0)) < 0.0


def test_what_returns_echoes_from_afar_but_looks_like_floor_stays_a_hint():
    floor, unseen = OccupancyGrid(), _view(2500.0)
    for i in range(6):
        pose = Pose(y_mm=40.0 * (i % 2))
        floor.add_view(pose, unseen, (pose, 1000.0))
        floor.add_echo(pose, 1000.0)
    assert _evidence_at(floor, 1100.0) > HINT
    _look(floor, unseen, times=10)
    assert _evidence_at(floor, 1100.0) > HINT


def test_what_is_nearer_than_the_frame_shows_is_not_taken_for_unseen():
    """The echo of a door post marks an arc across the door, which later views from farther away clear."""
    floor = OccupancyGrid()
    beside = VisibleFloor(*(each[np.abs(BEARINGS) > 12.0] for each in astuple(_view(2500.0))[:5]))
    for i in range(6):
        pose = Pose(y_mm=40.0 * (i % 2))
        floor.add_view(pose, beside, (pose, 300.0))
        floor.add_echo(pose, 300.0)
    assert _evidence_at(floor, 400.0) > SOLID
    for i in range(10):
        floor.add_view(Pose(-500.0, 40.0 * (i % 2)), _view(3000.0))
    assert _evidence_at(floor, 400.0) < 0.0


def test_evidence_of_an_echo_goes_where_the_camera_sees_free_floor_beside_the_thing():
    floor = OccupancyGrid()
    for i in range(6):
        floor.add_echo(Pose(y_mm=40.0 * (i % 2)), 900.0)
    before = _evidence_at(floor, *Pose(heading_deg=10.0).ahead(1000.0))
    _look(floor, _view(2000.0))
    assert before > HINT
    assert _evidence_at(floor, *Pose(heading_deg=10.0).ahead(1000.0)) < 0.0


@pytest.mark.parametrize("silences", [0, 3])
def test_what_is_touched_where_the_floor_looked_free_was_overlooked_and_is_not_about_to_leave(silences):
    floor = OccupancyGrid()
    for i in range(silences):
        floor.add_no_echo(Pose(100.0 * i))
    _look(floor, _view(2500.0), times=10)
    floor.decay(0.0)
    floor.decay(2.0)
    floor.mark_obstacle(Pose(400.0), 0.0)
    _look(floor, _view(2500.0), times=10)
    touched = _evidence_at(floor, 600.0)
    floor.decay(2.0 + APPEARED_DECAY_S)
    assert touched > SOLID
    assert _evidence_at(floor, 600.0) > 0.8 * touched


def test_a_robot_that_kept_away_from_what_it_saw_has_touched_something_else():
    floor, pose = OccupancyGrid(), Pose(600.0)
    _look(floor, _view(1000.0))
    floor.mark_obstacle(pose, 150.0)
    assert _evidence_at(floor, 930.0, 160.0) <= 0.0, "the wall is marked larger where it is nearest"
    floor.mark_obstacle(pose, 150.0)
    assert _evidence_at(floor, 930.0, 160.0) > SOLID


def test_what_was_touched_before_is_larger_though_the_robot_has_stood_on_part_of_its_mark():
    floor, pose = OccupancyGrid(), Pose(850.0)
    _look(floor, _view(1000.0))
    floor.mark_obstacle(pose, 0.0)
    floor.clear_footprint(Pose(880.0))  # odometry errs
    assert _evidence_at(floor, 960.0) < 0.0
    floor.mark_obstacle(pose, 0.0)
    assert _evidence_at(floor, 1160.0, 160.0) > SOLID


@pytest.mark.parametrize("tilt_deg", [6.0, 7.0, 8.0])
def test_a_camera_that_is_tilted_far_more_than_usual_is_learned_too(tilt_deg):
    ranges = _ranges()
    _learn(ranges, tilt_deg=tilt_deg)
    assert _ahead(ranges.measure(_wall(1500.0, tilt_deg=tilt_deg)).end_mm) == pytest.approx(1500.0, rel=0.05)


def test_how_far_the_floor_is_surely_free_does_not_depend_on_what_is_farther_away():
    ranges = FloorRanges(CameraTable(), SONAR_AHEAD_MM, BEAM_DEG, calibrated=False)
    rows = [ranges.measure([FloorRay(0.0, NEAR_DEG, end_deg)]) for end_deg in (0.5, 3.0, 6.0)]
    assert len({float(row.free_mm[0]) for row in rows}) == 1
    assert float(rows[0].free_mm[0]) < 800.0, "without the lens's height a metre is not known to 0.2 m"
