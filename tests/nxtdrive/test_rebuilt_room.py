"""A room made from a run's map: like the room that the robot was in, as far as it explored it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from nxtdrive.cli.main import main
from nxtdrive.simulated.rebuilt_room import OVER_MM, rebuilt
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.task import run_episode

MISSION = {
    "mission": {"targets": ["lena"]},
    "target": {"lena": {"detector": "picture", "pictures": ["lena.png"], "height_mm": 297}},
    "robot": {"wheel_diameter_mm": 43.2, "axle_track_mm": 130.0, "left": "A", "right": "B", "left_reversed": True},
    "camera": {"hfov_deg": 70.0, "height_mm": 180.0},
}
LENA_MM = 1500.0


def _look(x_mm: float, y_mm: float, range_mm: float | None, *, seen: bool = False) -> Record:
    """A look at lena, who hangs straight ahead of the start."""
    sighting = {"distance_mm": LENA_MM - x_mm, "bearing_deg": 0.0} if seen else None
    data = {"pose": [x_mm, y_mm, 0.0], "range_mm": range_mm, "sighting": sighting}
    return Record(0.0, RecordKind.LOOK, "search", "lena", data)


def _mission(**tables: dict[str, object]) -> Mission:
    return Mission.model_validate(MISSION | tables)


def _before(range_mm: float, *, seen: bool) -> list[Record]:
    """Looks at something in front of the robot, which moves to and fro a little."""
    return [_look(30.0 * (i % 2), 0.0, range_mm - 30.0 * (i % 2), seen=seen) for i in range(8)]


def test_the_robot_is_the_missions_without_its_reversed_motors():
    scenario = rebuilt([_look(0.0, 0.0, None)], Mission.model_validate(MISSION))
    robot = scenario.world.robot
    assert (robot.wheel_diameter_mm, robot.track_mm, robot.left_port, robot.right_port) == (43.2, 130.0, "A", "B")
    assert (scenario.world.camera.hfov_deg, scenario.world.camera.height_mm) == (70.0, 180.0)
    assert not scenario.mission.robot.left_reversed


@pytest.mark.parametrize("seen", [True, False])
def test_an_obstacle_is_low_if_the_target_was_seen_past_it(seen):
    scenario = rebuilt(_before(500.0, seen=seen), Mission.model_validate(MISSION))
    (start_x, start_y), camera = scenario.world.robot.start_mm, scenario.world.camera
    ahead = [box for box in scenario.world.boxes if abs(box.at_mm[1] - start_y) <= OVER_MM]
    assert ahead
    assert all(abs(box.at_mm[0] - start_x - 600.0) < 120.0 for box in ahead)
    assert all((box.height_mm < camera.height_mm) is seen for box in ahead)


def test_a_large_robot_does_not_stand_in_an_obstacle():
    assert not rebuilt(_before(300.0, seen=False), _mission(robot={"radius_mm": 450.0})).world.boxes


def test_targets_that_were_never_seen_are_not_there():
    mission = Mission.model_validate(MISSION)
    assert not rebuilt(_before(500.0, seen=False), mission).world.pictures
    (lena,) = rebuilt(_before(500.0, seen=True), mission).world.pictures
    assert math.cos(math.radians(lena.facing_deg)) == pytest.approx(-1.0)


def test_a_journal_without_a_path_makes_no_room():
    with pytest.raises(ValueError, match="nowhere"):
        rebuilt([Record(0.0, RecordKind.START, "idle", "", {})], Mission.model_validate(MISSION))


@pytest.mark.parametrize(
    ("key", "described", "believed"), [("wheel_mismatch_percent", 4.0, 0.0), ("turn_slip_percent", 12.0, 0.0)]
)
def test_the_mission_does_not_correct_wheels_that_the_simulated_robot_does_not_have(key, described, believed):
    scenario = rebuilt([_look(0.0, 0.0, None)], _mission(robot={key: described}))
    assert getattr(scenario.mission.robot, key) == believed


def test_the_sonar_is_where_the_mission_says():
    room = rebuilt([_look(0.0, 0.0, None)], _mission(robot={"sonar_forward_mm": 30.0, "sonar_height_mm": 40.0})).world
    assert (room.ultrasonic.forward_mm, room.ultrasonic.height_mm) == (30.0, 40.0)


def test_the_smallest_robot_of_a_mission_has_a_room():
    assert rebuilt([_look(0.0, 0.0, None)], _mission(robot={"radius_mm": 50.0})).world.robot.radius_mm == 50.0


def test_what_the_simulator_cannot_have_is_reported_in_words():
    with pytest.raises(ValueError, match=r"^the simulator has no such robot: camera.tilt_deg: must be -30 or more"):
        rebuilt([_look(0.0, 0.0, None)], _mission(camera={"tilt_deg": -40.0}))


@pytest.fixture(scope="module", name="past")
def _past():
    generated = generate_scenario("clutter", 103)
    return generated, *run_episode(generated, "adaptive", "geometric")


@pytest.mark.slow
@pytest.mark.xdist_group("rebuilt")
def test_what_is_rebuilt_stands_where_it_stood(past):
    generated, trace, recorder = past
    room = rebuilt(recorder.records, generated.mission).world
    turn, start = math.radians(generated.world.robot.heading_deg), np.array(generated.world.robot.start_mm)
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def truly(point: tuple[float, float]) -> np.ndarray:
        return start + turned @ (np.array(point) - np.array(room.robot.start_mm))

    truth = {picture.name: picture.at_mm for picture in generated.world.pictures}
    assert {picture.name for picture in room.pictures} == set(generated.mission.mission.targets)
    for picture in room.pictures:
        assert math.dist(truly(picture.at_mm), truth[picture.name]) < 250.0
    plan = trace.samples[0].scene.plan
    gaps_mm = np.abs(plan.clearance_mm(np.array([truly(box.at_mm) for box in room.boxes])))
    assert np.mean(gaps_mm < 150.0) > 0.9


@pytest.mark.nightly
@pytest.mark.xdist_group("rebuilt")
def test_what_if_plays_a_run_of_a_real_robot_in_its_rebuilt_room(past, tmp_path, capsys):
    generated, _, recorder = past
    lines = [record.to_json() for record in recorder.records]
    (tmp_path / "journal.jsonl").write_text("\n".join(lines) + "\n")
    mission = generated.mission.model_dump(mode="json")
    mission["mission"]["time_limit_s"] = 15.0
    (tmp_path / "mission.json").write_text(json.dumps(mission))
    (tmp_path / "summary.json").write_text(json.dumps({"nxt": "usb://001653000001", "camera": "0"}))
    before = sorted(tmp_path.iterdir())
    assert main(["what-if", str(tmp_path), "--decision", "1", "--futures", "2", "--workers", "1", "--json"]) == 0
    shown = capsys.readouterr()
    (result,) = json.loads(shown.out)["runs"]
    assert len(result["decisions"][0]["candidates"]) > 1
    assert "room made from its map" in shown.err
    assert sorted(tmp_path.iterdir()) == before, "its decisions are not those of the journal"
