"""On a link with 0.3 s per request the robot looks at more frames, keeps turning, and keeps to its path.

With a detector that takes long it stops for each look.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest

from behaviors.adaptive.follow_path import KEPT, FollowPathSkill
from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.grid_tuning import FREE_NO_ECHO
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.path_planner import PathPlanner
from behaviors.adaptive.perception import BURST_FRAMES, FREE_MM, LATEST_LOOKS, Observation, Perception
from behaviors.adaptive.scan import ScanSkill
from behaviors.events import Event, Fact, Reason
from behaviors.ports import Pose
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue
from nxtdrive.brick import Brick
from nxtdrive.simulated.robot import GEOMETRIC, scenario_robot
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation

CELLS = Cells()

SLOW_MS = 300.0
COASTS_DEG = 6.0
MakePerception = Callable[..., Perception]


@pytest.fixture(name="perceive")
def _perceive() -> Iterator[tuple[MakePerception, list[Fact]]]:
    """A robot in a room without its first target, on a link of some latency, with a computer that takes its time to
    look; and what it reports."""
    bricks: list[Brick] = []
    facts: list[Fact] = []

    def make(
        latency_ms: float, look_s: float = 0.0, *, kind: str = "absent", seed: int = 100, dropout: float = 0.03
    ) -> Perception:
        scenario = generate_scenario(kind, seed)
        computer = scenario.world.computer.model_copy(update={"look_s": look_s})
        ultrasonic = scenario.world.ultrasonic.model_copy(update={"dropout": dropout})
        world = scenario.world.model_copy(update={"computer": computer, "ultrasonic": ultrasonic})
        simulation = Simulation(world, seed=seed)
        brick = Brick(SimTransport(simulation, latency_ms=latency_ms))
        bricks.append(brick)
        robot = scenario_robot(scenario, simulation, brick, GEOMETRIC, [])
        context = SkillContext(*robot.ports, robot.mission.thesis, lambda *_, **__: None, facts.append)
        return AdaptiveProfile(context, robot.mission, TargetQueue(robot.mission.mission.targets))._perception

    yield make, facts
    for brick in bricks:
        brick.close()


@pytest.mark.parametrize("look_s", [0.0, 0.6])
def test_the_floor_is_learned_from_frames_whose_own_echo_shows_it_free(perceive, monkeypatch, look_s):
    perception = perceive[0](2.0, look_s)
    known = []
    see = perception.context.vision.free_floor

    def free_floor(free_at_s):
        known.append(free_at_s is not None)
        return see(free_at_s)

    monkeypatch.setattr(perception.context.vision, "free_floor", free_floor)
    ranges_mm = []
    for _ in range(60):
        perception.drive(0.0, 90.0)
        ranges_mm.append(perception.step().range_mm)
    echoes_mm = [each for each in ranges_mm if each is not None]
    assert min(echoes_mm) < FREE_MM < max(echoes_mm)
    assert known[1:] == [each is not None and each > FREE_MM for each in ranges_mm[1:]]
    assert known[0], "before the first echo the floor ahead of the start is taken for free"


@pytest.mark.parametrize(
    ("latency_ms", "look_s", "frames"),
    [
        (2.0, 0.0, 1),
        (65.0, 0.0, 1),
        (SLOW_MS, 0.0, BURST_FRAMES),
        (2.0, 0.8, 1),
        (65.0, 0.5, 1),
        (SLOW_MS, 0.3, BURST_FRAMES),
    ],
)
def test_on_a_slow_link_each_step_looks_at_several_frames(perceive, latency_ms, look_s, frames):
    perception = perceive[0](latency_ms, look_s)
    for _ in range(5):
        perception.drive(0.0, 1.0)
        observation = perception.step()
    assert len(observation.frames) == frames
    assert perception.world.floor.weight == frames


def test_where_echoes_show_that_nothing_distant_is_in_view_a_look_round_is_faster(perceive):
    """What is near is larger, and bears more blur."""
    took_s = []
    for farthest_mm in (1.0, 4500.0):
        perception = perceive[0](2.0)
        targets = perception.world.targets
        targets.detection_range_mm = dict.fromkeys(targets.detection_range_mm, farthest_mm)
        begun_s = perception.now()
        assert ScanSkill(perception).call().event is Event.SEARCH_FAILED
        took_s.append(perception.now() - begun_s)
    assert took_s[1] < 0.85 * took_s[0]


def test_a_look_round_over_a_slow_link_takes_less_than_twice_as_long(perceive):
    took_s = []
    for latency_ms in (2.0, SLOW_MS):
        perception = perceive[0](latency_ms)
        for _ in range(3):
            perception.step()
        begun_s = perception.now()
        assert ScanSkill(perception).call().event is Event.SEARCH_FAILED
        took_s.append(perception.now() - begun_s)
    assert took_s[1] < 2.0 * took_s[0]


@pytest.fixture(name="looked_at")
def _looked_at(monkeypatch) -> list[Pose]:
    """The poses at which the robot looked at a frame without turning on, but for what it takes to stop."""
    poses: list[Pose] = []
    step = Perception.step

    def noted(self: Perception) -> Observation:
        before = self.context.body.pose()
        observation = step(self)
        if abs(self.world.pose.heading_deg - before.heading_deg) < COASTS_DEG:
            poses.append(self.world.pose)
        return observation

    monkeypatch.setattr(Perception, "step", noted)
    return poses


def test_with_slow_looks_a_look_round_stops_for_each_and_listens_in_between(perceive, looked_at):
    perception = perceive[0](2.0, 0.8)
    for _ in range(LATEST_LOOKS):
        perception.step()
    looked_at.clear()
    heard = []
    perceived = perception.world.perceive
    perception.world.perceive = lambda *args, **options: (heard.append(args[1]), perceived(*args, **options))[1]
    begun_s = perception.now()
    assert ScanSkill(perception).call().event is Event.SEARCH_FAILED
    headings = sorted(pose.heading_deg for pose in looked_at)
    apart = [after - before for before, after in pairwise(headings)]
    assert headings[-1] - headings[0] > 330.0
    assert max(apart) < 2 * perception.world.targets.half_view_deg, "each bearing is in view of a frame"
    assert perception.now() - begun_s < 0.8 * len(looked_at) + 1.3 * 425.0 / perception.parameters.scan_deg_s
    echoes = sorted(pose.heading_deg for pose in heard)
    assert max(after - before for before, after in pairwise(echoes)) < 12.0


def test_what_one_slow_look_finds_is_looked_at_again_before_the_robot_turns_on(perceive, looked_at):
    perception = perceive[0](2.0, 0.8, kind="wall_start")
    for _ in range(LATEST_LOOKS):
        perception.step()
    looked_at.clear()
    assert ScanSkill(perception).call().event is Event.TARGET_SEEN
    turned = [abs(after.heading_deg - before.heading_deg) for before, after in pairwise(looked_at)]
    assert turned[-1] < 1.0, "the second frame confirms what the first one shows"
    assert all(each > COASTS_DEG for each in turned[:-1]), "nothing is in view before"


def test_a_camera_whose_first_frame_comes_late_is_not_slow(perceive):
    perception = perceive[0](2.0)
    glance = perception.context.vision.glance
    delays_s = iter((2.0, 0.0, 0.9, 0.9, 0.0, 0.0))

    def late(targets):
        perception.context.clock.sleep(next(delays_s))
        return glance(targets)

    perception.context.vision.glance = late
    for _ in range(6):
        perception.step()
        assert not perception.looks_are_slow


def test_an_echo_over_a_slow_link_clears_as_much_as_several_from_nearby_over_a_fast_one():
    fast, slow = OccupancyGrid(), OccupancyGrid()
    slow.weight = 3.0
    slow.add_no_echo(Pose())
    for heading_deg in (-3.0, 0.0, 3.0):
        fast.add_no_echo(Pose(heading_deg=heading_deg))
    place = CELLS.at(600.0, 0.0)
    assert slow.log_odds[place] == pytest.approx(fast.log_odds[place]) == pytest.approx(-3 * FREE_NO_ECHO)


def test_one_echo_over_a_slow_link_is_no_more_certain_than_over_a_fast_one_of_where_on_its_arc_something_stands():
    floor = OccupancyGrid()
    floor.weight = 3.0
    floor.add_echo(Pose(), 500.0)
    assert floor.clear_between((0.0, 0.0), (1000.0, 0.0))
    floor.add_echo(Pose(30.0), 470.0)
    assert not floor.clear_between((0.0, 0.0), (1000.0, 0.0))


def test_a_path_takes_as_long_as_the_best_one_unless_something_blocks_it():
    floor = OccupancyGrid()
    for x_mm in np.arange(0.0, 1500.0, 50.0):
        floor.clear_footprint(Pose(x_mm))
    end = (1400.0, 0.0)
    planner = PathPlanner(floor, (0.0, 0.0), 200.0)
    assert planner.seconds_along((end,)) == pytest.approx(float(planner.seconds_to(np.array([end]))[0]), rel=0.1)
    floor.mark_obstacle(Pose(500.0), 0.0)
    assert PathPlanner(floor, (0.0, 0.0), 200.0).seconds_along((end,)) == math.inf
    assert planner.seconds_along(((90_000.0, 0.0),)) == math.inf


def test_a_path_that_is_hardly_worse_than_the_best_is_kept(perceive):
    make, facts = perceive
    perception = make(2.0)
    perception.step()
    x_mm, y_mm = perception.world.here
    goal = x_mm - 300.0, y_mm
    route = ((x_mm - 150.0, y_mm + 20.0), goal)
    FollowPathSkill(perception, route).call()
    assert KEPT > 1.0
    assert not [fact for fact in facts if fact.reason is Reason.PATH_RENEWED]


@pytest.mark.parametrize(("latency_ms", "dropout"), [(2.0, 0.03), (SLOW_MS, 0.03), (2.0, 1.0)])
def test_a_long_path_is_driven_to_its_end_at_any_speed(perceive, latency_ms, dropout):
    """Over a slow link and without a sonar the robot drives at half its speed; the path takes no longer for that."""
    perception = perceive[0](latency_ms, kind="far", seed=101, dropout=dropout)
    perception.context.body.turn(-79.0)  # to where no target comes into view
    for _ in range(5):
        perception.step()
    pose = perception.world.pose
    for along_mm in range(0, 2600, 100):  # as if it had driven there before
        perception.world.floor.clear_footprint(Pose(*pose.ahead(float(along_mm)), pose.heading_deg))
    goal = pose.ahead(2400.0)
    fact = FollowPathSkill(perception, (goal,)).call()
    assert fact.reason is Reason.THERE
    assert math.dist(perception.world.here, goal) < 300.0


def test_a_waypoint_that_was_driven_past_between_two_looks_is_passed(perceive):
    perception = perceive[0](2.0)
    perception.step()
    x_mm, y_mm = perception.world.here
    skill = FollowPathSkill(perception, ((x_mm + 400.0, y_mm), (x_mm + 400.0, y_mm + 400.0)))
    for along_mm, aside_mm, passed in ((0.0, 0.0, False), (270.0, 0.0, False), (390.0, 80.0, True), (540.0, 0.0, True)):
        perception.world.pose = Pose(x_mm + along_mm, y_mm + aside_mm)
        assert skill._passed((x_mm + 400.0, y_mm)) is passed
