"""Shortest paths and lines of sight on floors whose answers are known."""

import math
from random import Random

import numpy as np
import pytest

from sim_backend.scenarios.classes import generate_room
from sim_backend.scenarios.floor_plan import CELL_MM, FloorPlan, Goal, MotionLimits, Obstacle, Path
from sim_backend.world.world_file import Camera

ROBOT_MM = 115.0


def _wall(x_mm, from_mm, to_mm):
    return Obstacle("wall", (x_mm, (from_mm + to_mm) / 2), (to_mm - from_mm, 20.0), 90.0)


def test_in_an_empty_room_the_path_is_straight_and_ends_where_a_stop_counts():
    plan = FloorPlan((4000.0, 3000.0), ())
    path = plan.path((500.0, 1500.0), Goal("lena", (3800.0, 1500.0), 180.0), ROBOT_MM)
    assert path.length_mm == pytest.approx(3300 - 500, abs=CELL_MM)
    assert len(path.points) == 2


def test_a_picture_is_reached_from_its_front_only():
    plan = FloorPlan((4000.0, 4000.0), (Obstacle("lena", (2000.0, 2000.0), (10.0, 105.0), 0.0),))
    path = plan.path((500.0, 2000.0), Goal("lena", (2000.0, 2000.0), 0.0), ROBOT_MM)
    end = path.points[-1]
    bearing = math.degrees(math.atan2(end[1] - 2000, end[0] - 2000))
    assert math.dist(end, (2000, 2000)) <= 500
    assert abs(bearing) <= 75


def test_the_path_round_a_wall_keeps_the_robots_radius_from_its_end():
    plan = FloorPlan((4000.0, 4000.0), (_wall(2000.0, 0.0, 3000.0),))
    start, goal = (1000.0, 1000.0), Goal("lena", (3000.0, 1000.0), 90.0)
    path = plan.path(start, goal, ROBOT_MM)
    # the corner is a circle of the robot's radius around the wall's end
    around = 2 * math.dist(start, (2000, 3000 + ROBOT_MM))
    assert around - 500 - 2 * ROBOT_MM < path.length_mm < around - 500 + 3 * CELL_MM
    line = np.concatenate([np.linspace(a, b, 200) for a, b in zip(path.points, path.points[1:], strict=False)])
    assert plan.clearance_mm(line).min() >= ROBOT_MM - CELL_MM / 10


def test_there_is_no_path_through_a_door_that_is_too_narrow():
    def plan(gap_mm):
        return FloorPlan(
            (4000.0, 3000.0), (_wall(2000.0, 0.0, 1500 - gap_mm / 2), _wall(2000.0, 1500 + gap_mm / 2, 3000.0))
        )

    goal = Goal("lena", (3500.0, 1500.0), 180.0)
    assert plan(200.0).path((500.0, 1500.0), goal, ROBOT_MM) is None
    assert plan(400.0).path((500.0, 1500.0), goal, ROBOT_MM) is not None


def test_the_path_from_the_goal_has_no_length():
    plan = FloorPlan((4000.0, 3000.0), ())
    assert plan.path((3400.0, 1500.0), Goal("lena", (3800.0, 1500.0), 180.0), ROBOT_MM).length_mm == 0


def test_high_things_hide_a_picture_and_low_ones_do_not():
    goal, camera = Goal("lena", (3500.0, 1500.0), 180.0), np.array([[500.0, 1500.0]])
    for height_mm, seen in ((1000.0, False), (120.0, True)):
        plan = FloorPlan((4000.0, 3000.0), (Obstacle("box", (2000.0, 1500.0), (300.0, 300.0), height_mm=height_mm),))
        assert plan.sees(camera, goal).tolist() == [seen]


def test_a_low_camera_does_not_see_over_what_a_high_one_does():
    goal, here = Goal("lena", (3500.0, 1500.0), 180.0), np.array([[500.0, 1500.0]])
    boxes = (Obstacle("box", (2000.0, 1500.0), (300.0, 300.0), height_mm=170.0),)
    for height_mm, seen in ((250.0, True), (100.0, False)):
        plan = FloorPlan((4000.0, 3000.0), boxes, Camera(height_mm=height_mm))
        assert plan.sees(here, goal).tolist() == [seen]


def test_the_fastest_time_counts_turns_and_acceleration():
    path = Path(((0.0, 0.0), (1000.0, 0.0), (1000.0, 1000.0)))
    limits = MotionLimits(speed_mm_s=200.0, speed_mm_s2=400.0, turn_deg_s=120.0, turn_deg_s2=300.0)
    straight_s, turn_s = 1000 / 200 + 0.5, 90 / 120 + 0.4
    assert path.duration_s(0.0, limits) == pytest.approx(2 * straight_s + turn_s)
    assert path.duration_s(-90.0, limits) == pytest.approx(2 * straight_s + 2 * turn_s)


@pytest.mark.parametrize("kind", ["clutter", "narrow_door", "everyday"])
def test_what_is_reachable_is_what_has_a_path(kind):
    builder = generate_room(kind, 3)
    plan, random = builder.plan(), Random(5)
    found = []
    for _ in range(12):
        start, at = builder.place(50.0), builder.place(50.0)
        goal, radius_mm = Goal("g", at, random.uniform(0.0, 360.0)), random.choice((115.0, 200.0, 330.0))
        found.append(plan.path(start, goal, radius_mm) is not None)
        assert plan.reachable(start, [goal], radius_mm) == found[-1]
    assert len(set(found)) == 2


def test_obstacles_that_are_left_out_as_too_far_away_change_no_clearance_within_the_distance():
    random = Random(11)
    for _ in range(40):
        obstacles = [
            Obstacle(
                "box",
                (random.uniform(-200, 4200), random.uniform(-200, 3200)),
                (random.uniform(0, 900), random.uniform(0, 900)),
                random.uniform(0, 360),
                random.uniform(0, 200),
            )
            for _ in range(12)
        ]
        plan = FloorPlan((4000.0, 3000.0), tuple(obstacles))
        corner = np.array([random.uniform(0, 3000), random.uniform(0, 2000)])
        points = corner + np.array([[random.uniform(0, 600), random.uniform(0, 600)] for _ in range(30)])
        distance_mm = random.uniform(0, 400)
        near = plan.near(points, distance_mm)
        assert len(near.obstacles) < len(obstacles)
        all_of_them, some = plan.clearance_mm(points), near.clearance_mm(points)
        assert np.array_equal(np.minimum(some, distance_mm), np.minimum(all_of_them, distance_mm))
