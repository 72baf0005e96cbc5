"""Robot files: precedence, refused values, and where values are used."""

import math
from datetime import date

import pytest

from behaviors.adaptive.grid_cells import Cells
from behaviors.adaptive.occupancy_grid import OccupancyGrid
from behaviors.adaptive.world_model import WorldModel
from behaviors.mission import Mission, MissionError, chosen_robot_file, described_by, load_mission
from behaviors.mission.robot import CameraTable, RobotFile, RobotFileError, RobotTable, load_robot_file
from behaviors.ports import Glimpse, Pose, Sighting
from tests.small_mission import COLOR_MISSION as MISSION

CELLS = Cells()


def _file(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture
def files(tmp_path):
    """Return three robot files, each with another diameter of the wheels."""
    for name, diameter_mm in (("option", 60), ("named", 70), ("usual", 80)):
        _file(tmp_path, f"{name}.toml", f"[robot]\nwheel_diameter_mm = {diameter_mm}\naxle_track_mm = 150\n")
    return tmp_path


@pytest.mark.parametrize(
    ("option", "named", "usual", "diameter_mm"),
    [
        (False, False, False, 56.0),
        (False, False, True, 80.0),
        (False, True, False, 70.0),
        (False, True, True, 70.0),
        (True, False, False, 60.0),
        (True, True, True, 60.0),
    ],
)
def test_which_robot_file_counts(files, option, named, usual, diameter_mm):
    text = MISSION.replace("[mission]", '[mission]\nrobot_file = "named.toml"') if named else MISSION
    mission = load_mission(
        _file(files, "m.toml", text),
        robot=files / "option.toml" if option else None,
        default_robot=files / "usual.toml" if usual else None,
    )
    assert mission.robot.wheel_diameter_mm == diameter_mm


def test_keys_of_the_mission_come_before_those_of_the_robot_file(files):
    mission = load_mission(
        _file(files, "m.toml", MISSION + "[robot]\nwheel_diameter_mm = 43.2\n"), robot=files / "option.toml"
    )
    assert (mission.robot.wheel_diameter_mm, mission.robot.axle_track_mm) == (43.2, 150.0)
    assert mission.robot.model_fields_set == {"wheel_diameter_mm", "axle_track_mm"}


def test_a_mission_made_by_a_program_takes_a_robot_file_too():
    mission = Mission.model_validate(
        {
            "mission": {"targets": ["a"]},
            "target": {"a": {"detector": "marker", "id": 0}},
            "camera": {"hfov_deg": 50.0},
        }
    )
    described = RobotFile(camera=CameraTable(hfov_deg=70.0, yaw_deg=3.0), robot=RobotTable(radius_mm=90.0))
    merged = described_by(mission, described)
    assert (merged.camera.hfov_deg, merged.camera.yaw_deg, merged.robot.radius_mm) == (50.0, 3.0, 90.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[robot]\nwheel_diameter_mm = 5\n", "robot.wheel_diameter_mm"),
        ("[robot]\nwheel_diameter = 56\n", "wheel_diameter_mm"),
        ("[camera]\ntilt_deg = 90\n", "camera.tilt_deg"),
        ('[robot]\nleft = "C"\n', "left and right both use port C"),
        ("[calibration]\nformat = 2\n", "calibration.format"),
        ("[calibration.camera]\nmethod = 'sheet'\n", "calibration.camera.date"),
        (MISSION, r"robot\.toml is a mission, not a robot file"),
        ("[floor]\nsize_mm = [1, 1]\n[robot]\nstart_mm = [1, 1]\n", r"robot\.toml is a world, not a robot file"),
        ("[[boxes]]\nname = 'a'\n", "boxes"),
        ("[motor]\nleft_reversed = true\n", r"motor: there is no such table; its keys belong in \[robot\]"),
        (
            "[project]\nname = 'a'\n[[tool]]\n",
            r"robot\.toml is not a robot file: it has no \[robot\] and no \[camera\]",
        ),
        ("no toml", "is not TOML"),
    ],
)
def test_a_robot_file_with_mistakes_is_refused(tmp_path, text, expected):
    path = _file(tmp_path, "robot.toml", text)
    with pytest.raises(RobotFileError, match=expected) as caught:
        load_robot_file(path)
    assert str(path) in str(caught.value)


def test_mistakes_of_the_mission_do_not_hide_that_its_robot_file_is_not_there(tmp_path):
    path = _file(tmp_path, "m.toml", MISSION.replace("[mission]", '[mission]\nrounds = 0\nrobot_file = "gone.toml"'))
    with pytest.raises(MissionError, match=r": 2 mistakes\n  mission\.rounds: .*\n.*gone\.toml: cannot be read"):
        load_mission(path)


def test_a_mission_without_a_file_has_no_robot_file_beside_it(tmp_path):
    assert chosen_robot_file("robot.toml", None, None, tmp_path / "usual.toml") == tmp_path / "usual.toml"


def test_a_port_of_the_mission_may_not_be_one_of_the_robot_file(tmp_path):
    robot = _file(tmp_path, "robot.toml", '[robot]\nleft = "A"\n')
    path = _file(tmp_path, "m.toml", MISSION + '[robot]\nright = "A"\n')
    with pytest.raises(MissionError, match="both use port A"):
        load_mission(path, robot=robot)


def test_a_robot_file_says_when_and_how_it_was_measured(tmp_path):
    text = '[calibration]\nbrick_name = "NXT"\n[calibration.camera]\ndate = 2026-11-22\nmethod = "sheet"\n'
    described = load_robot_file(_file(tmp_path, "robot.toml", text))
    assert described.calibration.camera.date == date(2026, 11, 22)


@pytest.mark.parametrize("sonar_forward_mm", [-50.0, 150.0])
def test_an_echo_is_mapped_from_the_sonar(sonar_forward_mm):
    floor = OccupancyGrid(RobotTable(sonar_forward_mm=sonar_forward_mm))
    floor.add_echo(Pose(), 400.0)
    assert floor.log_odds[CELLS.at(sonar_forward_mm + 400.0, 0.0)] > 0


@pytest.mark.parametrize(
    ("mission", "robot", "said"),
    [
        (MISSION, None, "NXT_ROBOT: .*gone.toml: cannot be read"),
        (
            MISSION.replace("[mission]", '[mission]\nrobot_file = "gone.toml"'),
            None,
            "m.toml: mission.robot_file: .*gone",
        ),
        (MISSION, "absent.toml", "absent.toml: cannot be read"),
    ],
)
def test_a_missing_robot_file_is_reported_with_what_named_it(tmp_path, monkeypatch, mission, robot, said):
    monkeypatch.setenv("NXT_ROBOT", str(tmp_path / "gone.toml"))
    path = _file(tmp_path, "m.toml", mission)
    with pytest.raises(MissionError, match=said):
        load_mission(path, robot=tmp_path / robot if robot else None, default_robot=tmp_path / "gone.toml")


@pytest.mark.parametrize("radius_mm", [90.0, 300.0])
def test_the_robot_needs_as_much_room_as_it_is_large(radius_mm):
    floor = OccupancyGrid(RobotTable(radius_mm=radius_mm))
    floor.mark_obstacle(Pose(0.0, 500.0), 0.0)
    assert floor.clear_between((0.0, 0.0), (1000.0, 0.0)) is (radius_mm < 200.0)


def test_the_place_of_a_target_is_measured_from_the_lens():
    camera = CameraTable(forward_mm=80.0, right_mm=-30.0)
    mission = Mission.model_validate(
        {"mission": {"targets": ["a"]}, "target": {"a": {"detector": "marker", "id": 0}}, "camera": camera.model_dump()}
    )
    world = WorldModel(mission)
    heading = Pose(0.0, 0.0, 90.0)
    seen = Sighting("a", 10.0, 1000.0, 1.0, 0.0, (0, 0, 30, 30))
    world.perceive(0.0, heading, None, ["a"], Glimpse(0.0, {"a": seen}))
    # heading 90: forward is along y, right is along -x
    ahead, right = 1000 * math.cos(math.radians(10)) + 80, 1000 * math.sin(math.radians(10)) - 30
    assert world.targets.known["a"].place == pytest.approx((-right, ahead))
    bearing_deg, distance_mm = world.sight_to(world.targets.known["a"].place)
    assert distance_mm == pytest.approx(1000.0)
    assert bearing_deg == pytest.approx(math.degrees(math.atan2(right, ahead)))


def test_a_camera_that_looks_to_the_side_has_looked_there():
    camera = CameraTable(forward_mm=50.0, yaw_deg=20.0)
    view = camera.view_at(Pose(10.0, 20.0, 90.0))
    assert (view.x_mm, view.y_mm, view.heading_deg) == pytest.approx((10.0, 70.0, 110.0))


def test_a_ray_meets_the_floor_nearer_the_steeper_it_points_down():
    camera = CameraTable(height_mm=200.0)
    assert [camera.floor_mm(below_deg) for below_deg in (30.0, 45.0, 60.0)] == pytest.approx(
        [346.4, 200.0, 115.5], abs=0.1
    )


def test_wheels_that_slip_in_turns_turn_a_robot_as_if_they_were_farther_apart():
    assert RobotTable(axle_track_mm=120.0, turn_slip_percent=20.0).turning_track_mm == pytest.approx(150.0)
    assert RobotTable(axle_track_mm=120.0).turning_track_mm == 120.0
