"""What the adaptive profile learns from a failure, and its evidence, on the simulated robot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from behaviors.adaptive.approach import ApproachSkill
from behaviors.adaptive.attempts import BESIDE_MM
from behaviors.adaptive.follow_path import FollowPathSkill
from behaviors.adaptive.grid_cells import CELL_MM, Cells
from behaviors.adaptive.grid_tuning import MAX_LOG_ODDS, SOLID
from behaviors.adaptive.perception import BLOCKER_MM, blocker_without_echo
from behaviors.adaptive.target_memory import TargetEstimate
from behaviors.adaptive.wait_rescan import BLOCKED_MM, WaitSkill
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Event, Reason
from behaviors.evidence import Evidence, evidence_from
from behaviors.failures import Blocker, Failure, TargetFinding
from behaviors.journal import RecordKind
from behaviors.ports import Glimpse, Pose, Sighting, StopReason
from behaviors.profiles.adaptive import MIN_INTERVAL_S, AdaptiveProfile
from behaviors.recoveries import CHANGE_TARGET
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetOutcome, TargetQueue
from nxtdrive.brick import Brick
from nxtdrive.recording.wording import evidence_lines
from nxtdrive.simulated.robot import GEOMETRIC, scenario_robot
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from nxtdrive.tools.sweep.task import run_episode
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation

CELLS = Cells()


class Bench:
    """A profile on a robot that stands in an empty room."""

    def __init__(self, brick: Brick, simulation: Simulation, scenario: Scenario) -> None:
        robot = scenario_robot(scenario, simulation, brick, GEOMETRIC, [])
        context = SkillContext(*robot.ports, robot.mission.thesis, lambda *_, **__: None, lambda _: None)
        self.queue = TargetQueue(robot.mission.mission.targets)
        self.profile = AdaptiveProfile(context, robot.mission, self.queue)
        self.world: WorldModel = self.profile.world

    def evidence(self, failure: Failure) -> Evidence:
        """What is known after a failure."""
        self.profile.learn(failure)
        return self.profile.evidence(Evidence(self.queue.target, failure.reason, seen_since_search=True, researches=0))


@pytest.fixture(name="bench")
def _bench() -> Iterator[Bench]:
    with _bench_of("open") as bench:
        yield bench


@contextmanager
def _bench_of(name: str) -> Iterator[Bench]:
    scenario = generate_scenario(name, 100)
    simulation = Simulation(scenario.world, seed=100)
    with Brick(SimTransport(simulation)) as brick:
        yield Bench(brick, simulation, scenario)


@pytest.mark.parametrize("range_mm", [2000.0, None, 100.0])
def test_what_gives_no_echo_is_near_whatever_echoes_behind_it(bench, range_mm):
    failure = Failure(Event.ARRIVE_FAILED, Reason.NO_PROGRESS, blocker=blocker_without_echo(range_mm))
    blocker = bench.evidence(failure).blocker
    assert blocker is not None
    assert blocker.range_mm == min(range_mm or BLOCKER_MM, BLOCKER_MM)
    assert not bench.world.floor.clear_between((0.0, 0.0), (600.0, 0.0))
    assert bench.world.floor.log_odds.max() > SOLID


def test_a_remembered_obstacle_is_where_it_is_remembered(bench):
    """The echo is of whatever else is there now."""
    world, target = bench.world, bench.queue.target
    ahead = Sighting(target, 0.0, 2000.0, 1.0, 0.0, (100, 80, 40, 56))
    world.perceive(0.0, Pose(), None, [target], Glimpse(0.0, {target: ahead}))
    world.floor.log_odds[CELLS.at(400.0, 0.0)] = MAX_LOG_ODDS
    fact = ApproachSkill(bench.profile._perception, trusts_map=True).call()
    assert fact.reason is Reason.BLOCKED_LONG
    assert fact.measured["range_mm"] == pytest.approx(400.0 - world.floor.sonar_forward_mm, abs=CELL_MM)


def test_an_oblique_view_that_flickers_does_not_make_the_target_gone(bench):
    belief = bench.world.targets.beliefs[bench.queue.target]
    belief.see((1000.0, 0.0), (0.0, 0.0))
    before = belief.held_at((1000.0, 0.0))
    bench.evidence(Failure(Event.ARRIVE_FAILED, Reason.TARGET_LOST))
    assert belief.held_at((1000.0, 0.0)) == pytest.approx(before)
    bench.evidence(Failure(Event.ARRIVE_FAILED, Reason.TARGET_LOST, finding=TargetFinding.MOVED))
    assert belief.held_at((1000.0, 0.0)) < before


def test_a_target_whose_turns_are_over_does_not_wait(bench):
    first, second = bench.queue.targets
    bench.queue.rounds = 1
    assert bench.evidence(Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN)).targets_left == 2
    bench.queue.decide(TargetOutcome.GIVEN_UP)
    bench.queue.next_target()
    assert bench.queue.current is second
    assert first.outcome is TargetOutcome.GIVEN_UP
    assert bench.evidence(Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN)).targets_left == 1


@pytest.mark.parametrize("seen", [True, False])
def test_a_target_that_was_left_unseen_and_is_seen_on_the_way_to_another_comes_next(seen):
    with _bench_of("flat") as bench:
        first, second, third = bench.queue.names
        evidence = bench.evidence(Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN))
        assert bench.profile.select(replace(evidence, here=None, viewpoints=())).kind is CHANGE_TARGET
        bench.queue.decide(TargetOutcome.GIVEN_UP)
        bench.queue.next_target(second)
        bench.profile.skill("search", None)
        if seen:
            ahead = Sighting(first, 0.0, 800.0, 1.0, 0.0, (100, 80, 40, 56))
            bench.world.perceive(0.0, Pose(), None, [first], Glimpse(0.0, {first: ahead}))
        bench.queue.decide(TargetOutcome.REACHED)
        bench.queue.next_target()
        assert bench.queue.target == (first if seen else third)


def test_evidence_is_gathered_without_changing_what_is_known(bench):
    world, target = bench.world, bench.queue.target
    ahead = Sighting(target, 0.0, 2000.0, 1.0, 0.0, (100, 80, 40, 56))
    world.perceive(0.0, Pose(), 500.0, [target], Glimpse(0.0, {target: ahead}))
    blocked = Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_SHORT, blocker=Blocker(500.0, 0.0, moving=True, hides=True))
    first = bench.evidence(blocked)
    before = deepcopy(world)
    basis = Evidence(target, blocked.reason, seen_since_search=True, researches=0)
    assert bench.profile.evidence(basis) == first
    assert np.array_equal(world.floor.log_odds, before.floor.log_odds)
    assert world.targets.known == before.targets.known
    assert world.targets.beliefs[target].held_at((2000.0, 0.0)) == before.targets.beliefs[target].held_at((2000.0, 0.0))


def test_a_blocker_that_is_met_again_at_the_same_place_grows_older(bench):
    blocker = Blocker(500.0, 0.0, moving=True, hides=True)
    blocked = Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_SHORT, blocker=blocker)
    world, target = bench.world, bench.queue.target
    world.learn(target, blocked, 10.0)
    assert world.blocker == blocker
    world.learn(target, blocked, 25.0)
    assert world.blocker == replace(blocker, age_s=15.0)
    world.learn(target, replace(blocked, blocker=replace(blocker, range_mm=1500.0)), 30.0)
    assert world.blocker is not None
    assert world.blocker.age_s == 0.0
    world.learn(target, Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN), 31.0)
    assert world.blocker is None


def test_a_blocker_from_the_map_is_not_mapped_again(bench):
    blocker = Blocker(300.0, 0.0, moving=False, hides=False)
    failure = Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_LONG, blocker=blocker, mapped=True)
    bench.world.learn(bench.queue.target, failure, 1.0)
    assert bench.world.floor.log_odds.max() <= 0.0
    bench.world.learn(bench.queue.target, replace(failure, mapped=False), 2.0)
    assert bench.world.floor.log_odds.max() > SOLID


def test_a_look_alike_is_not_taken_for_the_target_again_for_some_time(bench):
    world, target = bench.world, bench.queue.target

    def seen(time_s: float) -> bool:
        ahead = Sighting(target, 0.0, 1500.0, 1.0, time_s, (100, 80, 40, 56))
        return target in world.perceive(time_s, Pose(), None, [target], Glimpse(time_s, {target: ahead}))

    assert seen(1.0)
    world.learn(target, Failure(Event.ARRIVE_FAILED, Reason.WRONG_TARGET, finding=TargetFinding.LOOK_ALIKE), 1.0)
    assert target not in world.targets.known
    assert not seen(5.0)
    assert seen(100.0)


def test_a_look_round_from_here_makes_the_next_one_from_here_no_news(bench):
    world, target = bench.world, bench.queue.target
    assert world.targets.novelty(target, (0.0, 0.0)) == 1.0
    world.learn(target, Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN, finding=TargetFinding.NOT_HERE), 1.0)
    assert world.targets.novelty(target, (0.0, 0.0)) == 0.0
    assert 0.9 < world.targets.novelty(target, (3000.0, 0.0)) < 1.0


def test_a_target_seen_again_from_where_its_approach_failed_does_not_end_the_path_elsewhere(bench):
    assert bench.profile.skill("search", None).call().event is Event.TARGET_SEEN
    begin = bench.world.here
    failed = Failure(Event.ARRIVE_FAILED, Reason.BLOCKED_LONG, blocker=Blocker(2000.0, hides=False))
    bench.evidence(failed)
    fact = FollowPathSkill(bench.profile._perception, (bench.world.pose.ahead(700.0),)).call()
    assert fact.event is Event.TARGET_SEEN
    assert math.dist(bench.world.here, begin) >= BESIDE_MM


def test_a_robot_that_an_obstacle_stopped_turns_away_from_it_before_it_drives_on(bench, mocker):
    """While the obstacle is still ahead, the safety stop holds a robot that drives before it has turned far enough."""
    perception, body = bench.profile._perception, bench.profile._perception.context.body
    perception.step()
    begin_deg, drive = bench.world.pose.heading_deg, body.drive

    def with_an_obstacle_ahead(speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        if speed_mm_s > 0 and abs(body.pose().heading_deg - begin_deg) < 20.0:
            body.stop()
            return StopReason.OBSTACLE
        return drive(speed_mm_s, turn_deg_s)

    mocker.patch.object(body, "drive", with_an_obstacle_ahead)
    fact = FollowPathSkill(perception, (bench.world.pose.ahead(500.0, 28.0),)).call()
    assert (fact.event, fact.reason) == (Event.RECOVERY_DONE, Reason.THERE)


@pytest.mark.parametrize(("working", "fast"), [(True, True), (False, False)])
def test_along_a_path_it_travels_faster_than_in_an_approach_while_the_sonar_works(bench, mocker, working, fast):
    perception = bench.profile._perception
    perception.step()
    if not working:
        mocker.patch.object(type(perception.sonar), "silent", new=True)
    drive = mocker.spy(perception.context.body, "drive")
    FollowPathSkill(perception, (bench.world.pose.ahead(500.0),)).call()
    fastest_mm_s = max(call.args[0] for call in drive.call_args_list)
    assert (fastest_mm_s > 1.2 * perception.parameters.cruise_mm_s) is fast


def test_a_path_that_becomes_much_longer_is_ended(bench, mocker):
    """Another choice may be better now; a wall showed that the way there is long."""
    perception, world = bench.profile._perception, bench.world
    mocker.patch.object(perception.context.vision, "glance", return_value=Glimpse(0.0, {}))
    perception.step()
    goal = world.pose.ahead(1500.0)
    skill = FollowPathSkill(perception, (goal,))
    replan = skill._replan

    def behind_a_wall(*args: object) -> object:
        for off_deg in range(-75, 76, 5):
            world.floor.mark_obstacle(Pose(*world.here, world.pose.heading_deg + off_deg), 400.0)
        return replan(*args)

    mocker.patch.object(skill, "_replan", behind_a_wall)
    fact = skill.call()
    assert fact.reason is Reason.NO_WAY
    assert math.dist(world.here, goal) > 500.0


def test_a_skill_that_fails_at_once_leads_to_no_second_decision_at_once(bench):
    perception = bench.profile._perception
    bench.profile.select(bench.evidence(Failure(Event.SEARCH_FAILED, Reason.NEVER_SEEN)))
    decided_s = perception.now()
    assert bench.profile.skill("arrive", None).call().event is Event.ARRIVE_FAILED
    assert perception.now() - decided_s >= MIN_INTERVAL_S
    begun_s = perception.now()
    assert bench.profile.skill("arrive", None).call().event is Event.ARRIVE_FAILED
    assert perception.now() - begun_s < MIN_INTERVAL_S, "the decision was made long ago"


@pytest.mark.parametrize(("round_trip_ms", "slow"), [(2.0, False), (300.0, True)])
def test_on_a_slow_link_it_steers_gently_and_a_target_is_not_lost_after_one_frame(round_trip_ms, slow):
    scenario = generate_scenario("open", 100)
    simulation = Simulation(scenario.world, seed=100)
    with Brick(SimTransport(simulation, latency_ms=round_trip_ms)) as brick:
        perception = Bench(brick, simulation, scenario).profile._perception
        for _ in range(6):
            perception.step()
        assert (perception.lost_after_s > perception.parameters.lost_after_s) == slow
        assert (perception.steering_deg_s(10.0, 2.0) < 20.0) == slow


@pytest.mark.parametrize(("nearer_mm", "ends"), [(300.0, Event.RECOVERY_DONE), (0.0, Event.RECOVERY_FAILED)])
def test_what_echoes_from_well_beyond_the_blocker_is_not_the_blocker(bench, mocker, nearer_mm, ends):
    """Whoever stood in a doorway has left when only its posts return echoes."""
    perception = bench.profile._perception
    mocker.patch.object(perception.context.vision, "glance", return_value=Glimpse(0.0, {}))
    perception.context.body.straight(4000.0)
    perception.context.body.straight(-300.0)
    range_mm = perception.step().range_mm
    assert range_mm < BLOCKED_MM
    bench.world.blocker = Blocker(range_mm - nearer_mm, moving=True)
    assert WaitSkill(perception, 3.0).call().event is ends


@pytest.mark.parametrize(("works", "ends"), [(True, Event.RECOVERY_DONE), (False, Event.RECOVERY_FAILED)])
def test_without_a_sonar_nothing_shows_that_a_blocker_has_left(bench, mocker, works, ends):
    perception = bench.profile._perception
    mocker.patch.object(perception.context.vision, "glance", return_value=Glimpse(0.0, {}))
    perception.step()
    mocker.patch.object(type(perception.sonar), "silent", new=not works)
    mocker.patch.object(perception.context.body, "range_mm", return_value=None)
    bench.world.blocker = Blocker(150.0)
    assert WaitSkill(perception, 3.0).call().event is ends


@pytest.mark.parametrize("bearing_deg", [0.0, 80.0, -150.0])
def test_a_wait_watches_the_blocker(bench, mocker, bearing_deg):
    perception = bench.profile._perception
    mocker.patch.object(perception.context.vision, "glance", return_value=Glimpse(0.0, {}))
    bench.world.blocker = Blocker(400.0, moving=True, bearing_deg=bearing_deg)
    heading_deg = perception.context.body.pose().heading_deg
    WaitSkill(perception, 1.0).call()
    turned_deg = perception.context.body.pose().heading_deg - heading_deg
    assert turned_deg == pytest.approx(bearing_deg, abs=3.0)


@pytest.mark.slow
def test_a_person_who_comes_into_the_only_door_is_waited_for():
    """The place beyond is worth it; nothing else in the room is."""
    trace, recorder = run_episode(generate_scenario("doorway", 3013), "adaptive", "geometric")
    waits = [each for each in recorder.records if each.kind is RecordKind.CHOICE and each.data["choice"] == "wait"]
    evidence = waits[0].data["evidence"]
    assert evidence["reason"] == Reason.NO_WAY
    assert evidence["blocker"]["moving"]
    assert evidence["blocked"]["chance"] > 0.0
    told = list(evidence_lines(evidence_from(waits[0].target, evidence)))
    assert any("beyond it a place to look from" in line for line in told)
    assert trace.ending == "achieved"


def test_a_target_that_was_seen_a_day_ago_may_still_be_the_next(bench):
    world, seen = bench.world, bench.queue.names[1]
    world.targets.known[seen] = TargetEstimate((900.0, 0.0), -86_400.0, 900.0, Pose(0.0, 0.0, 0.0))
    assert bench.queue.first_of(bench.queue.names) == seen
