"""World model: a sighting is placed by the pose at its frame, settles, and moves with the target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from random import Random

import pytest

from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.grid_tuning import HINT, SOLID
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Event, Reason
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.mission import Mission
from behaviors.ports import FloorRay, Glimpse, Point, Pose, Sighting

CELLS = Cells()

LAG_S = 0.15
"""How old a frame is when its sighting is known."""
NOTHING = Glimpse(0.0, {})


@pytest.fixture(name="world")
def _world() -> WorldModel:
    return WorldModel(
        Mission.model_validate(
            {
                "mission": {"targets": ["door", "window"]},
                "target": {name: {"detector": "marker", "id": i} for i, name in enumerate(("door", "window"))},
            }
        )
    )


def _sighting(place: Point, pose: Pose, time_s: float, target: str = "door") -> Sighting:
    """What the camera makes of something at a place."""
    dx, dy = place[0] - pose.x_mm, place[1] - pose.y_mm
    bearing_deg = math.degrees(math.atan2(dy, dx)) - pose.heading_deg
    return Sighting(target, bearing_deg, math.hypot(dx, dy), 1.0, time_s, (100, 80, 40, 56))


def _see(world: WorldModel, place: Point, time_s: float, target: str = "door", pose: Pose | None = None) -> None:
    pose = pose or Pose()
    world.perceive(time_s, pose, None, [target], Glimpse(time_s, {target: _sighting(place, pose, time_s, target)}))


def _stand_at(world: WorldModel, place: Point) -> None:
    world.perceive(0.0, Pose(*place), None, [], NOTHING)


@pytest.mark.parametrize("rate_deg_s", [-60.0, -20.0, 40.0, 90.0])
def test_a_target_that_is_seen_while_turning_is_placed_right(world, rate_deg_s):
    """The frame is older than the pose at which its sighting becomes known."""
    place, pose = (1200.0, 300.0), Pose()
    for i in range(20):
        now_s = i * 0.07
        pose = Pose(0.0, 0.0, rate_deg_s * now_s)
        then_s = max(0.0, now_s - LAG_S)
        then = Pose(0.0, 0.0, rate_deg_s * then_s)
        world.perceive(now_s, pose, None, ["door"], Glimpse(then_s, {"door": _sighting(place, then, then_s)}))
    assert math.dist(world.targets.known["door"].place, place) < 20.0
    bearing_deg, distance_mm = world.pose.polar_to(place)
    expected_deg = math.degrees(math.atan2(place[1], place[0])) - pose.heading_deg
    assert bearing_deg == pytest.approx((expected_deg + 180.0) % 360.0 - 180.0)
    assert distance_mm == pytest.approx(math.hypot(*place))


def test_the_estimate_settles_among_noisy_sightings(world):
    random, place = Random(7), (1500.0, -400.0)
    noisy = [(place[0] + random.gauss(0.0, 80.0), place[1] + random.gauss(0.0, 80.0)) for _ in range(60)]
    errors = []
    for i, each in enumerate(noisy):
        _see(world, each, i * 0.1)
        errors.append(math.dist(world.targets.known["door"].place, place))
    single = sum(math.dist(each, place) for each in noisy[10:]) / 50
    assert sum(errors[10:]) / 50 < 0.7 * single


def test_a_target_that_moves_a_little_is_followed(world):
    for i in range(30):
        _see(world, (1500.0, -400.0 + 5.0 * i), i * 0.1)
    assert math.dist(world.targets.known["door"].place, (1500.0, -255.0)) < 30.0


def test_a_target_that_is_seen_only_elsewhere_for_a_while_is_there(world):
    for i in range(10):
        _see(world, (1500.0, -400.0), i * 0.1)
    _see(world, (900.0, 700.0), 2.0)
    assert world.targets.known["door"].place == pytest.approx((900.0, 700.0))


def test_a_target_that_is_seen_in_two_places_at_once_stays_where_it_was_seen_first(world):
    for i in range(20):
        _see(world, ((1500.0, -400.0), (900.0, 700.0))[i % 2], i * 0.1)
    assert world.targets.known["door"].place == pytest.approx((1500.0, -400.0))


def test_what_is_doubtful_is_likely_again_after_looks_from_two_places_without_a_better_one(world):
    place = (1500.0, -400.0)
    _see(world, (900.0, 900.0), 0.0)
    _see(world, place, 2.0)
    world.learn("door", Failure(Event.MISTAKEN, Reason.UNCERTAIN, finding=TargetFinding.UNCERTAIN), 0.1)
    assert "door" not in world.targets.known
    assert not world.targets.look_alikes.accepts("door", place)
    doubted = world.targets.beliefs["door"].held_at(place)
    for here in ((0.0, 0.0), (700.0, 500.0)):
        _stand_at(world, here)
        world.learn("door", Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN, finding=TargetFinding.NOT_HERE), 1.0)
    assert world.targets.look_alikes.accepts("door", place)
    assert world.targets.beliefs["door"].held_at(place) > 5 * doubted


def test_what_is_doubtful_is_looked_for_elsewhere_though_nothing_else_was_taken_for_the_target(world):
    place = (1500.0, -400.0)
    _see(world, place, 0.0)
    likely = world.targets.beliefs["door"].held_at(place)
    world.learn("door", Failure(Event.MISTAKEN, Reason.UNCERTAIN, finding=TargetFinding.UNCERTAIN), 0.1)
    assert world.targets.beliefs["door"].held_at(place) < 0.2 * likely, "a scan would show nothing but this place"


def test_the_estimate_has_when_and_how_far_away_the_target_was_seen(world):
    _see(world, (1500.0, 0.0), 4.0, pose=Pose(300.0, 100.0))
    known = world.targets.known["door"]
    assert known.time_s == 4.0
    assert known.distance_mm == pytest.approx(math.dist((300.0, 100.0), (1500.0, 0.0)))
    assert "window" not in world.targets.known


def test_what_is_forgotten_is_not_believed_to_be_there_any_more(world):
    place = (1200.0, 0.0)
    _see(world, place, 0.0)
    seen = world.targets.beliefs["door"].chance_from(0.0, 0.0, world.floor)
    not_there = Failure(Event.RECOVERY_FAILED, Reason.NEVER_SEEN, finding=TargetFinding.NOT_THERE)
    world.learn("door", not_there, 1.0)
    world.learn("window", not_there, 1.0)
    assert not world.targets.known
    assert world.targets.beliefs["door"].chance_from(0.0, 0.0, world.floor) < 0.5 * seen


def _look_in_vain(world: WorldModel, looked_for: Sequence[str], heading_deg: float) -> None:
    for i in range(10):
        world.perceive(i * 0.1, Pose(0.0, 0.0, heading_deg), None, looked_for, Glimpse(i * 0.1, {}))
    world.targets.flush_looks()


def test_looks_in_vain_count_for_those_that_were_looked_for(world):
    _look_in_vain(world, ["door"], 0.0)
    door, window = (world.targets.beliefs[name].chance_from(0.0, 0.0, world.floor) for name in ("door", "window"))
    assert door < window


def test_looks_in_one_direction_leave_the_others_as_they_are(world):
    _look_in_vain(world, ["door"], 90.0)
    begin_deg, end_deg = world.targets.beliefs["door"].arc_from(0.0, 0.0, world.floor, 36.0)
    assert (90.0 - begin_deg) % 360.0 > end_deg - begin_deg


def test_a_look_in_vain_while_turning_counts_where_its_frame_was_taken(world):
    for i in range(20):
        now_s, rate_deg_s = i * 0.1, 90.0 if i > 10 else 0.0
        pose = Pose(0.0, 0.0, rate_deg_s * (now_s - 1.0))
        world.perceive(now_s, pose, None, ["door"] if i > 10 else [], Glimpse(min(now_s, 1.0), {}))
    world.targets.flush_looks()
    begin_deg, end_deg = world.targets.beliefs["door"].arc_from(0.0, 0.0, world.floor, 36.0)
    assert (0.0 - begin_deg) % 360.0 > end_deg - begin_deg
    assert (90.0 - begin_deg) % 360.0 < end_deg - begin_deg


def test_echoes_go_onto_the_floor_map_and_silence_marks_nothing(world):
    for i in range(6):
        world.perceive(i * 0.1, Pose(-40.0 * (i % 2)), 500.0 + 40.0 * (i % 2), [], NOTHING)
    assert world.floor.log_odds.max() > SOLID
    silent = WorldModel(
        Mission.model_validate({"mission": {"targets": ["a"]}, "target": {"a": {"detector": "marker", "id": 0}}})
    )
    for i in range(6):
        silent.perceive(i * 0.1, Pose(40.0 * i), None, [], NOTHING)
    assert silent.floor.log_odds.max() <= 0.0


def test_an_echo_belongs_to_where_the_robot_is_and_not_to_where_an_older_frame_was_taken(world):
    """The robot has turned to a post since a frame that shows free floor ahead, and the post to the right."""
    bearings, post_mm = [float(each) for each in range(-27, 28, 3)], 900.0
    height_mm = world.camera.height_mm
    rays = [
        FloorRay(each, 23.0, math.degrees(math.atan2(height_mm, post_mm if each >= 18.0 else 2500.0)))
        for each in bearings
    ]
    for i in range(8):
        back_mm, time_s = 30.0 * (i % 2), float(i)
        world.perceive(time_s, Pose(-back_mm), None, [], NOTHING)
        world.perceive(time_s + 0.5, Pose(-back_mm, 0.0, 21.0), None, [], NOTHING)
        world.see_floor(time_s, rays, post_mm + back_mm - 160.0)
    assert float(world.floor.log_odds[CELLS.at(700.0, 20.0)]) < -HINT
    assert not world.floor.seen[CELLS.at(post_mm, 20.0)]


MOVES = Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_SHORT, blocker=Blocker(400.0, moving=True, hides=True))
NO_PATH = Failure(Event.RECOVERY_FAILED, Reason.NO_WAY)


def test_a_blocker_that_moved_remains_one_that_moves(world):
    world.learn("door", MOVES, 10.0)
    world.learn("door", replace(MOVES, blocker=Blocker(420.0, hides=True)), 15.0)
    assert world.blocker == Blocker(420.0, 5.0, moving=True, hides=True)
    world.learn("door", replace(MOVES, blocker=Blocker(1500.0, hides=True)), 16.0)
    assert not world.blocker.moving, "that is something else"


def test_where_there_is_no_path_the_last_blocker_is_still_the_cause(world):
    world.learn("door", MOVES, 10.0)
    world.pose = Pose(0.0, 0.0, -90.0)  # it has turned left to go round
    world.learn("door", NO_PATH, 15.0)
    blocker = world.blocker
    assert (blocker.age_s, blocker.moving, blocker.hides) == (5.0, True, True)
    assert blocker.bearing_deg == pytest.approx(90.0)


@pytest.mark.parametrize(
    ("failure", "pose", "later_s"),
    [
        pytest.param(NO_PATH, Pose(-600.0, 0.0), 5.0, id="it is far away"),
        pytest.param(NO_PATH, Pose(), 60.0, id="that was long ago"),
        pytest.param(Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN), Pose(), 5.0, id="the path is not the trouble"),
    ],
)
def test_the_last_blocker_is_not_the_cause_of_everything(world, failure, pose, later_s):
    world.learn("door", MOVES, 10.0)
    world.pose = pose
    world.learn("door", failure, 10.0 + later_s)
    assert world.blocker is None


def test_a_corrected_heading_is_not_a_turn(world):
    beams = [(Pose(heading_deg=each), 900.0) for each in range(0, 370, 10)]
    world.floor.save()
    for i, (pose, range_mm) in enumerate(beams):
        world.perceive(0.1 * i, pose, range_mm, [], NOTHING)
    world.turned(1.03, beams)
    world.perceive(3.8, Pose(heading_deg=371.0), 900.0, [], NOTHING)
    assert world.poses.turn_deg_s(3.75) == 0.0


def test_a_target_seen_in_a_corrected_turn_is_where_the_corrected_heading_says(world):
    elsewhere = (0.0, 3000.0)
    _see(world, elsewhere, 0.0, "window", Pose(0.0, 2000.0, 90.0))
    beams = [(Pose(heading_deg=float(each)), 900.0) for each in range(0, 370, 10)]
    world.floor.save()
    for i, (pose, _) in enumerate(beams):
        by_wheels = Pose(heading_deg=300.0).ahead(1500.0)
        seen = {"door": _sighting(by_wheels, pose, 1.0 + i)} if pose.heading_deg == 300.0 else {}
        world.perceive(1.0 + i, pose, 900.0, list(seen), Glimpse(1.0 + i, seen))
    world.turned(1.05, beams)
    place = Pose(heading_deg=315.0).ahead(1500.0)
    assert world.targets.known["door"].place == pytest.approx(place)
    assert world.targets.beliefs["door"].held_at(place) > 0.5
    assert world.targets.known["window"].place == pytest.approx(elsewhere)
