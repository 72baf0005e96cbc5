"""The world that tests arrange."""

import math
import os
import re

import pytest

from firmware_protocol.direct import GetBatteryLevel
from firmware_protocol.errors import AddressError, ConfigError, LinkLost
from nxtdrive import open_brick
from nxtdrive.mission.camera import GEOMETRIC, open_mission_camera
from nxtdrive.mission.vision import mission_vision
from nxtdrive.testing import SimWorld
from nxtdrive.vision.target_vision import GeometricVision
from sim_backend.bundled import PICTURES
from sim_backend.devices import TouchSensor, UltrasonicSensor


def test_a_picture_stands_where_it_is_put_and_looks_at_the_robot(sim_world):
    sim_world.put("lena", x_mm=1500)
    assert sim_world.truth.pictures["lena"] == pytest.approx((1500, 1500, 180))
    assert sim_world.truth.in_view("lena")
    assert sim_world.simulation.webcam.observe("lena")
    sim_world.put("lena", x_mm=400, y_mm=2500)
    assert sim_world.truth.pictures["lena"] == pytest.approx((400, 2500, -90))
    assert not sim_world.truth.in_view("lena")


def test_what_is_hidden_later_comes_back_in_its_place(sim_world):
    sim_world.put("lena", x_mm=1500).hide("lena", after_s=2, for_s=10)
    there = []
    for _ in range(14):
        there.append("lena" in sim_world.truth.pictures)
        sim_world.advance(1)
    assert there == [True] * 2 + [False] * 10 + [True] * 2
    assert sim_world.truth.pictures["lena"].x_mm == 1500


def test_the_camera_sees_what_was_put_there(sim_world):
    before = sim_world.simulation.camera_frame()
    sim_world.put("lena", x_mm=1200)
    sim_world.advance(0.2)
    assert (sim_world.simulation.camera_frame() != before).any()


def test_a_picture_of_ones_own_is_found_by_its_name(sim_world):
    sim_world.put_picture("my fox", PICTURES / "fox.png", x_mm=1500)
    assert any(sim_world.simulation.webcam.observe("my fox") for _ in range(10))
    assert sim_world.simulation.camera_frame() is not None


def test_a_box_in_front_is_measured_until_it_is_gone(sim_world, sim_brick):
    sonar = sim_brick.ultrasonic(4)
    sim_world.put_box("crate", x_mm=1000)
    assert sonar.distance_mm == pytest.approx(1000 - 100 - 500, abs=30)
    sim_world.put("crate", x_mm=1400)
    assert sonar.distance_mm == pytest.approx(1400 - 100 - 500, abs=30)
    sim_world.hide("crate")
    assert (sonar.distance_mm or 9999) > 2000


def test_a_box_put_against_the_bumper_presses_it(sim_world, sim_brick):
    bumper = sim_brick.touch(1)
    assert not bumper.pressed
    sim_world.put_box("crate", x_mm=400 + 115 + 95)
    sim_world.advance(0.1)
    assert bumper.pressed


@pytest.mark.parametrize(
    ("x_mm", "y_mm", "facing_deg"), [(400, None, 0), (400 + 115 + 65, None, 0), (400, 1390, 0), (470, 1570, 45)]
)
def test_a_box_on_the_robot_is_refused_with_what_is_free(sim_world, x_mm, y_mm, facing_deg):
    sim_world.place_robot(x_mm=400, y_mm=1500)
    with pytest.raises(ConfigError, match=r"'crate' would stand on the robot, at \(400, 1500\): it needs 115 mm"):
        sim_world.put_box("crate", x_mm=x_mm, y_mm=y_mm, facing_deg=facing_deg)
    sim_world.put_box("crate", x_mm=1000)


@pytest.mark.parametrize(
    "arrange",
    [
        lambda world: world.put_box("crate", x_mm=15000),
        lambda world: world.put_person("anna", x_mm=500, y_mm=-1),
        lambda world: world.put_picture("my fox", PICTURES / "fox.png", x_mm=4001),
        lambda world: world.put("lena", x_mm=15000, after_s=2),
        lambda world: world.put("lena", x_mm=float("nan")),
        lambda world: world.put_person("anna", x_mm=500).walk("anna", x_mm=500, y_mm=3001),
        lambda world: world.place_robot(x_mm=-100, y_mm=1000),
    ],
)
def test_a_place_outside_the_room_is_a_mistake(sim_world, arrange):
    with pytest.raises(ConfigError, match=r"is outside the floor of 4000 x 3000 mm"):
        arrange(sim_world)


@pytest.mark.parametrize("question", ["distance_mm", "in_view", "lens_distance_mm", "in_front_of_camera"])
def test_the_truth_names_what_there_is(sim_world, question):
    sim_world.put("lena", x_mm=1500).put_box("crate", x_mm=2500)
    with pytest.raises(ConfigError, match=r"there is no .*'nocrate' here; known: lena"):
        getattr(sim_world.truth, question)("nocrate")


@pytest.mark.parametrize(("facing_deg", "front"), [(180, True), (250, True), (280, False), (0, False)])
def test_the_camera_shows_the_front_of_a_picture_that_is_too_slanted_to_be_recognised(sim_world, facing_deg, front):
    sim_world.put("lena", x_mm=1500, facing_deg=facing_deg)
    assert sim_world.truth.in_front_of_camera("lena") is front


def test_people_stand_walk_and_vanish(sim_world):
    sim_world.put_person("anna", x_mm=2000).walk("anna", x_mm=2000, y_mm=700, after_s=1)
    assert sim_world.truth.people == {"anna": (2000, 1500)}
    sim_world.advance(1.5)
    assert 700 < sim_world.truth.people["anna"][1] < 1500
    sim_world.advance(1)
    assert sim_world.truth.people["anna"] == (2000, 700)
    sim_world.hide("anna")
    assert sim_world.truth.people == {}
    sim_world.put("anna", x_mm=1000)
    assert sim_world.truth.people == {"anna": (1000, 1500)}


def test_the_robot_can_be_put_elsewhere(sim_world, sim_brick):
    sim_world.place_robot(x_mm=3000, y_mm=1000, heading_deg=180)
    assert sim_world.truth.pose == pytest.approx((3000, 1000, 180))
    assert (sim_brick.ultrasonic(4).distance_mm or 9999) > 2000
    sim_world.place_robot(x_mm=1000, y_mm=1000, heading_deg=180)
    assert sim_brick.ultrasonic(4).distance_mm == pytest.approx(900, abs=30)


def test_a_sensor_of_the_tests_own_is_plugged_in(sim_world, sim_brick):
    fingers = []
    sim_world.plug(2, TouchSensor(lambda: bool(fingers)))
    button = sim_brick.touch(2)
    assert not button.pressed
    fingers.append("thumb")
    sim_world.advance(0.01)
    assert button.pressed


@pytest.mark.parametrize(
    ("put", "said"),
    [
        (lambda world: world.put_box("crate", x_mm=1000, size_mm=300), "size_mm: must be a list in brackets"),
        (lambda world: world.put_box("crate", x_mm=1000, height_mm=-1), "height_mm: must be "),
        (lambda world: world.put_person("", x_mm=1000), "name: "),
    ],
)
def test_a_value_that_an_object_cannot_have_is_named(sim_world, put, said):
    with pytest.raises(ConfigError, match=said):
        put(sim_world)


def test_a_scripted_distance_may_have_a_fraction(sim_world, sim_brick):
    sim_world.plug(4, UltrasonicSensor(lambda: 80.7))
    assert sim_brick.ultrasonic(4).distance_mm == 800


@pytest.mark.parametrize("sensor", [17, "touch", TouchSensor, lambda: True])
def test_what_is_no_device_cannot_be_plugged_in(sim_world, sensor):
    with pytest.raises(ConfigError, match=r"is not a device\. .* as in TouchSensor\(lambda: True\)"):
        sim_world.plug(2, sensor)


def test_unknown_names_get_the_known_ones(sim_world):
    with pytest.raises(ConfigError, match=r"no 'lenna' .* fox, landscape, lena"):
        sim_world.put("lenna", x_mm=1000)
    sim_world.put("lena", x_mm=1500)
    with pytest.raises(ConfigError, match="known: lena"):
        sim_world.hide("crate")
    with pytest.raises(ConfigError, match="no person 'lena'"):
        sim_world.walk("lena", x_mm=1000)
    with pytest.raises(ConfigError, match="already"):
        sim_world.put_box("lena", x_mm=1000)
    with pytest.raises(ConfigError, match=r"no picture nowhere\.png"):
        sim_world.put_picture("cat", "nowhere.png", x_mm=1000)


@pytest.mark.sim_world("arena", seed=3, firmware="1.05", latency_ms=30)
def test_the_marker_chooses_the_world(sim_world, sim_brick):
    assert sim_world.simulation.world.file.title.startswith("Lena behind the partition")
    assert sim_brick.info().firmware == "1.05"
    before = sim_brick.now()
    sim_brick.request(GetBatteryLevel())
    assert sim_brick.now() - before == pytest.approx(0.030)


def test_a_program_that_opens_its_brick_itself_finds_this_one(sim_world):
    assert os.environ["NXT"] == sim_world.address
    with open_brick() as brick:
        brick.motor("B").run_angle(200, 90)
    assert abs(sim_world.truth.pose.heading_deg) > 5


def test_a_lost_link_is_followed_by_another_to_the_same_brick(sim_world, sim_brick):
    sim_brick.link.transport.close()
    with pytest.raises(LinkLost):
        sim_brick.request(GetBatteryLevel())
    sim_brick.link.reconnect()
    assert sim_brick.battery_v > 7
    assert sim_world.left_open == [sim_brick.link.transport]


MISSION = """
[mission]
name = "find lena"
targets = ["lena"]
profile = "thesis"
[target.lena]
detector = "picture"
pictures = ["lena.png"]
height_mm = 297
"""


@pytest.mark.slow
@pytest.mark.parametrize("rendered", [False, True])
def test_a_mission_waits_where_it_lost_the_target(sim_world, sim_brick, tmp_path, rendered):
    path = tmp_path / "find_lena.toml"
    path.write_text(MISSION)
    sim_world.put("lena", x_mm=2000).hide("lena", after_s=8, for_s=6)
    report = sim_world.run_mission(sim_brick, path, rendered=rendered)
    assert report.achieved
    assert "wait" in report.path
    assert sim_world.truth.distance_mm("lena") < 600


def test_a_picture_that_was_brought_in_is_found_by_geometry(sim_world, sim_brick, mission_for):
    sim_world.put("lena", x_mm=2000)
    camera = open_mission_camera(GEOMETRIC, sim_brick)
    assert isinstance(mission_vision(mission_for("lena"), sim_brick, camera, GEOMETRIC), GeometricVision)


def test_an_address_lives_as_long_as_its_world():
    with SimWorld() as world:
        address = world.address
        open_brick(address).close()
    with pytest.raises(AddressError, match="no running simulation"):
        open_brick(address)


def test_a_picture_that_is_not_there_is_named_with_the_folder(sim_world, here):
    with pytest.raises(ConfigError, match=re.escape(f"there is no picture cat.jpg in {here}.")):
        sim_world.put_picture("cat", "cat.jpg", x_mm=1000)
    with pytest.raises(ConfigError, match=re.escape(f"there is no picture cat.jpg in {here / 'mine'}.")):
        sim_world.put_picture("cat", "mine/cat.jpg", x_mm=1000)


@pytest.mark.parametrize("value", ["1000", None])
def test_a_place_must_be_numbers(sim_world, value):
    with pytest.raises(ConfigError, match=f"x_mm must be a number, not {value!r}"):
        sim_world.put_box("crate", x_mm=value)
    with pytest.raises(ConfigError, match="y_mm must be a number, not 'left'"):
        sim_world.place_robot(x_mm=1000, y_mm="left")


@pytest.mark.parametrize(
    ("value", "needed"),
    [(math.nan, "0 or more and finite"), (math.inf, "0 or more and finite"), (-1, "0 or more"), ("1", "a number")],
)
@pytest.mark.parametrize(
    "arrange",
    [
        lambda world, value: world.put("lena", x_mm=1000, after_s=value),
        lambda world, value: world.hide("fox", after_s=value),
        lambda world, value: world.hide("fox", for_s=value),
        lambda world, value: world.advance(value),
    ],
)
def test_a_time_must_not_lie_back(sim_world, arrange, value, needed):
    sim_world.put("fox", x_mm=1500).advance(0)
    with pytest.raises(ConfigError, match=f"_s must be {needed}.*, not {value!r}"):
        arrange(sim_world, value)
    sim_world.advance(1)
    assert "fox" in sim_world.truth.pictures


@pytest.mark.parametrize("value", [math.nan, math.inf, "left"])
def test_a_direction_must_be_a_finite_number(sim_world, value):
    before = sim_world.truth.pose
    with pytest.raises(ConfigError, match="facing_deg must be"):
        sim_world.put("lena", x_mm=1000, facing_deg=value)
    with pytest.raises(ConfigError, match="heading_deg must be"):
        sim_world.place_robot(x_mm=1000, y_mm=1000, heading_deg=value)
    assert sim_world.truth.pose == before


@pytest.mark.parametrize("value", [math.nan, 0, -1, "3"])
def test_a_limit_of_time_must_be_positive(value):
    with pytest.raises(ConfigError, match="time_limit_s must be"):
        SimWorld(time_limit_s=value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"latency_ms": -3}, "latency_ms must be from 0 to 10000, not -3"),
        ({"latency_ms": math.nan}, "latency_ms must be from 0 to 10000, not nan"),
        ({"latency_ms": 1e9}, "latency_ms must be from 0 to 10000"),
        ({"latency_ms": "30"}, "latency_ms must be a number, not '30'"),
        ({"firmware": 1.05}, r"there is no firmware 1.05; it is '1.29', '1.05' or '1.32', in quotes"),
        ({"firmware": "1.5"}, "there is no firmware '1.5'"),
        ({"seed": "3"}, "seed must be a whole number, not '3'"),
        ({"seed": None}, "seed must be a whole number, not None"),
    ],
)
def test_wrong_arguments_of_a_world_are_refused(arguments, message):
    with pytest.raises(ConfigError, match=message):
        SimWorld(**arguments)
