"""Scenarios depend on class and seed alone and can always be solved."""

import hashlib
import itertools
import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nxtdrive.simulated.robot import DegradedSensor
from nxtdrive.simulated.scenario import generate_scenario
from sim_backend.scenarios.classes import ALL_CLASSES
from sim_backend.scenarios.handicaps import PICTURES_APART_MM
from sim_backend.scenarios.hard import HARD
from sim_backend.simulation import Simulation
from sim_backend.world.loading import parse_world

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ALL_CLASSES)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_every_seed_gives_a_world_that_stands_up(kind, seed, tmp_path_factory):
    scenario = generate_scenario(kind, seed)
    # the loader checks what a world file on its own cannot: names, places, images
    parse_world(scenario.world.model_dump(), tmp_path_factory.getbasetemp() / "world.toml")
    simulation = Simulation(scenario.world, seed=seed)
    simulation.advance(10)
    assert simulation.truth.contacts == 0
    missing = [name for name in scenario.mission.mission.targets if name not in simulation.truth.pictures]
    assert len(missing) == (kind == "absent")


@pytest.mark.parametrize("kind", ALL_CLASSES)
def test_class_and_seed_decide_everything(kind):
    generated = [generate_scenario.__wrapped__(kind, 7) for _ in range(2)]
    assert generated[0] == generated[1]
    assert generated[0] != generate_scenario(kind, 8)


def test_only_the_class_for_it_has_a_compass():
    for seed in range(10):
        scenario, plain = generate_scenario("compass_distortion", seed), generate_scenario("slip", seed)
        assert [(sensor.kind, sensor.port) for sensor in scenario.world.sensors] == [("compass", 2)]
        assert scenario.mission.robot.compass == 2
        assert 1 <= len(scenario.world.magnets) <= 3
        assert (plain.world.sensors, plain.world.magnets, plain.mission.robot.compass) == ((), (), 0)


def test_far_targets_are_out_of_sight_at_the_start():
    for seed in range(20):
        scenario = generate_scenario("far", seed)
        first = next(p for p in scenario.world.pictures if p.name == scenario.mission.mission.targets[0])
        assert math.dist(first.at_mm, scenario.world.robot.start_mm) >= 3000


@pytest.mark.slow
@pytest.mark.parametrize("kind", ALL_CLASSES)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_no_picture_stands_or_comes_to_stand_in_front_of_another(kind, seed):
    world = generate_scenario(kind, seed).world
    places = {picture.name: [picture.at_mm] for picture in world.pictures}
    for event in world.events:
        if event.picture and event.to_mm:
            places[event.picture].append(event.to_mm)
    for one, other in itertools.combinations(places.values(), 2):
        assert min(math.dist(a, b) for a in one for b in other) >= PICTURES_APART_MM


@pytest.mark.parametrize(("kind", "rooms", "targets", "limit_s"), [("flat", 4, 3, 240), ("big", 12, 6, 600)])
def test_a_flat_has_rooms_on_a_corridor_and_a_target_in_each_of_some(kind, rooms, targets, limit_s):
    scenario = generate_scenario(kind, 3)
    doors = {wall.to_mm for wall in scenario.world.walls if wall.from_mm[1] == wall.to_mm[1]}
    assert len(doors) // 2 <= rooms
    assert len(scenario.mission.mission.targets) == len(scenario.world.pictures) == targets
    assert scenario.mission.mission.time_limit_s == limit_s


def test_a_home_has_prints_of_several_sizes_and_its_mission_knows_them():
    sizes = set()
    for seed in range(10):
        scenario = generate_scenario("home", seed)
        heights = {picture.name: picture.size_mm[1] for picture in scenario.world.pictures}
        assert {name: target.height_mm for name, target in scenario.mission.target.items()} == heights
        sizes.update(heights.values())
    assert sizes == {148.0, 210.0, 297.0}


def test_furniture_in_homes_is_inside_and_keeps_away_from_what_hangs_on_the_walls():
    for seed in range(20):
        world = generate_scenario("home", seed).world
        for box in world.boxes:
            (depth, width), facing = box.size_mm, math.radians(box.facing_deg)
            x = (abs(math.cos(facing)) * depth + abs(math.sin(facing)) * width) / 2
            y = (abs(math.sin(facing)) * depth + abs(math.cos(facing)) * width) / 2
            assert x <= box.at_mm[0] <= world.floor.size_mm[0] - x
            assert y <= box.at_mm[1] <= world.floor.size_mm[1] - y
            if not box.name.startswith("leg"):
                reach = min(box.size_mm) / 2
                assert all(math.dist(box.at_mm, picture.at_mm) > reach for picture in world.pictures)


def test_every_other_robot_of_the_hard_suite_is_not_what_its_mission_describes():
    def robot(kind, seed):
        world = generate_scenario(kind, seed).world
        return world.camera.hfov_deg, world.robot.wheel_diameter_mm, world.robot.track_mm

    assert all(robot(kind, 4) == (60.0, 56.0, 112.0) for kind in ("flat", "hurry", "crowd"))
    assert all(robot(kind, 5)[i] != robot(kind, 4)[i] for kind in ("flat", "hurry", "crowd") for i in range(3))


def test_each_lookalike_is_mistaken_at_a_rate_of_its_own():
    scenario = generate_scenario("many_lookalikes", 3)
    view = scenario.conditions.view
    assert len(view.lookalikes) == len(view.mistake_rates) == 4
    assert all(0.1 <= rate <= 0.6 for rate in view.mistake_rates)
    simulation = Simulation(scenario.world, seed=3)
    one = replace(view, hit_rate=0.0, mistake_rates=(0.0, 0.0, 0.0, 1.0))
    sensor = DegradedSensor(simulation, one, 3)
    for lookalike in scenario.world.pictures:
        x, y = lookalike.at_mm
        facing = math.radians(lookalike.facing_deg)
        before = (x + 700 * math.cos(facing), y + 700 * math.sin(facing))
        simulation.world.place_robot(before, lookalike.facing_deg + 180)
        simulation.advance(200)
        taken = sensor.observe(scenario.mission.mission.targets[0]) is not None
        assert taken == (simulation.webcam.observe("lookalike3") is not None)
        assert taken or lookalike.name != "lookalike3"


@pytest.mark.parametrize("kind", HARD)
def test_each_class_of_the_hard_suite_says_what_it_asks(kind):
    text = (DOCS / "evaluation.md").read_text(encoding="utf-8")
    assert (HARD[kind].__doc__ or "").strip() in text


DIGESTS = {
    "open": "485af32510a8",
    "far": "09e4b99f41a4",
    "clutter": "3e520e32e835",
    "block_transient": "f29d03921fb9",
    "block_permanent": "80929ce7e2f6",
    "patrol": "7dbfcde3a46c",
    "absent": "534ddb7f2299",
    "moved": "66a7bebcb2a3",
    "dim": "f99f7f91ee1a",
    "slip": "3befd55ee8fd",
    "compass_distortion": "2d2cb117b912",
    "link": "df292cd8549c",
    "distractor": "a555fc5c3359",
    "camera_loss": "18a723a65b4c",
    "wall_start": "3d22ab65c3a0",
    "narrow_door": "04ba3e2cc370",
}
"""Digests of the first five scenarios of each class: figures of different versions compare the same missions."""


@pytest.mark.parametrize("kind", DIGESTS)
def test_a_class_generates_the_scenarios_that_it_always_generated(kind):
    def values(seed):
        scenario = generate_scenario(kind, seed)
        world = scenario.world.model_dump(mode="json", exclude_defaults=True)
        for picture in world["pictures"]:
            picture["file"] = Path(picture.get("file", "")).name
        mission = scenario.mission.mission.targets, scenario.mission.robot.compass
        view = asdict(scenario.conditions.view)
        assert view.pop("mistake_rates") == ()  # newer than the digests
        return world, mission, scenario.conditions.faults.silent_ms, scenario.conditions.latency_ms, view

    text = json.dumps([values(seed) for seed in range(5)], sort_keys=True)
    assert hashlib.sha256(text.encode()).hexdigest()[:12] == DIGESTS[kind]
