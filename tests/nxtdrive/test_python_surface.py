"""The Python interface: where names are, one object per port, clear errors."""

import numpy as np
import pytest

import nxtdrive
from firmware_protocol.errors import CameraError, ConfigError, LocalProtocolError
from nxtdrive import MotionResult, Pose, StopReason
from nxtdrive.motion.rover import Rover
from nxtdrive.transports.base import WallClock
from nxtdrive.vision.sources import open_camera

PUBLIC_NAMES = 25


def test_the_brick_is_a_facade_of_few_names(lab):
    brick = lab().brick
    names = [name for name in dir(brick) if not name.startswith("_")]
    assert len(names) <= PUBLIC_NAMES, names


def test_results_have_their_types_at_the_root(lab):
    result = Rover(lab().brick.link).straight(50)
    assert isinstance(result, MotionResult)
    assert result.stop is StopReason.DONE
    assert isinstance(nxtdrive.Pose(), Pose)


def test_what_is_asked_for_twice_is_one_object(lab):
    brick = lab().brick
    assert brick.ultrasonic(4) is brick.ultrasonic(4)
    assert brick.motor("A") is brick.motor("a")
    assert brick.light(3, lamp=False) is brick.light(3)
    assert brick.motor("A", reversed=True) is not brick.motor("A")
    assert brick.touch(4) is not brick.ultrasonic(4), "something else is plugged in now"


def test_a_sensor_is_set_up_once(lab):
    room = lab('[[boxes]]\nname = "box"\nat_mm = [2500, 1500]\nsize_mm = [200, 1000]\nheight_mm = 300\n')
    assert not room.brick.ultrasonic(4).ready
    assert room.brick.ultrasonic(4).distance_mm
    assert room.brick.ultrasonic(4).ready
    begun_ms = room.simulation.now_ms
    assert room.brick.ultrasonic(4).distance_mm
    assert room.simulation.now_ms - begun_ms < 20
    assert room.brick.rover().range_mm()
    assert room.simulation.now_ms - begun_ms < 40


def test_a_brick_can_be_renamed(lab):
    brick = lab().brick
    brick.name = "Robot 7"
    assert (brick.name, brick.info().name) == ("Robot 7", "Robot 7")
    with pytest.raises(LocalProtocolError):
        brick.name = "a name of more than 15"
    with pytest.raises(LocalProtocolError):
        brick.name = 7


def test_a_screenshot_shows_the_display(lab):
    picture = lab().brick.screenshot()
    assert (picture.shape, picture.dtype) == ((64, 100), bool)


@pytest.mark.parametrize(
    ("mistake", "name"),
    [
        (lambda brick: brick.rover().turn("90"), "angle_deg"),
        (lambda brick: brick.rover().straight(None), "distance_mm"),
        (lambda brick: brick.rover().straight("3"), r"^distance_mm must be a number from -10000 to 10000, not '3'\.$"),
        (lambda brick: brick.rover().straight(100, "fast"), "speed_mm_s"),
        (lambda brick: brick.rover().curve(100, float("nan")), "angle_deg"),
        (lambda brick: brick.rover().drive("200", 0), "speed_mm_s"),
        (lambda brick: brick.rover(safety=None), "safety"),
        (lambda brick: brick.rover(settings={}), "settings"),
        (lambda brick: brick.rover(wheel_diameter_mm="56"), "wheel_diameter_mm"),
        (lambda brick: brick.rover(reversed="no"), "reversed"),
        (lambda brick: brick.rover(reversed=(True,)), "reversed"),
        (lambda brick: brick.rover().reset_pose((0, 0, 0)), "pose must be a Pose"),
        (lambda brick: Rover(brick.link, ultrasonic=brick.touch(1)), "ultrasonic must be an Ultrasonic"),
        (lambda brick: brick.motor("A").run("fast"), "speed_deg_s"),
        (lambda brick: brick.motor("A").run_angle(360, "720"), "angle_deg"),
        (lambda brick: brick.motor("A").run_time(360, None), "duration_s"),
        (lambda brick: brick.motor("A").run_angle(360, 720, ["coast"]), "then"),
        (lambda brick: brick.motor("A").dc(True), "power"),
        (lambda brick: brick.motor("A", settings=0.3), "settings"),
        (lambda brick: brick.sleep(float("nan")), "duration_s"),
        (lambda brick: brick.touch(1).wait_for_press(float("nan")), "timeout_s"),
        (lambda brick: brick.motor(1), "1"),
        (lambda brick: brick.touch("1"), "'1'"),
        (lambda brick: brick.color(3).brightness_percent(["red"]), "lamp"),
        (lambda brick: brick.i2c(4, "2"), "address must be a whole number from 2 to 255, not '2'"),
        (lambda brick: brick.i2c(4, 1), "address must be a whole number from 2 to 255, not 1"),
        (lambda brick: brick.tone("a", 100), "frequency_hz"),
        (lambda brick: setattr(brick, "volume", 2.5), "volume must be a whole number from 0 to 4, not 2.5"),
        (lambda brick: brick.files.read(5), "5"),
        (lambda brick: brick.files.ls(5), "pattern must be a text, not 5"),
        (lambda brick: brick.programs.start(5), "name"),
        (lambda brick: brick.programs.write_message("1", "hello"), "box"),
        (lambda brick: brick.programs.write_message(1, 5), "message .* not 5"),
        (lambda brick: brick.programs.write_message(1, "5 €"), "message .* not '5 €'"),
        (lambda brick: brick.programs.write_message(1, "x" * 59), "message .* 58 characters, not 59"),
    ],
)
def test_a_wrong_argument_is_one_kind_of_error_that_names_it(lab, mistake, name):
    with pytest.raises(LocalProtocolError, match=name):
        mistake(lab().brick)


def test_a_list_may_say_which_wheels_are_reversed(lab):
    brick = lab().brick
    Rover(brick.link, reversed=[False, False], ultrasonic=None, touch=None).straight(100)
    assert brick.motor("B").angle > 0


@pytest.mark.parametrize("number", [np.float32(90.0), np.int64(90)])
def test_numbers_of_arrays_are_numbers(lab, number):
    brick = lab().brick
    rover = Rover(brick.link, ultrasonic=None, touch=None)
    assert rover.straight(number).distance_mm == pytest.approx(90, abs=3)
    assert rover.turn(number).turned_deg == pytest.approx(90, abs=3)
    rover.reset_pose(Pose(number, number, number))
    assert rover.drive(number, number) is None
    motor = brick.motor("A")
    motor.dc(number)
    motor.run_angle(number, number)
    motor.reset_angle(number)
    assert motor.angle == 90
    assert not brick.touch(1).wait_for_press(number)


def test_whole_numbers_of_arrays_are_whole_numbers(lab):
    brick = lab().brick
    brick.volume = np.int64(2)
    assert brick.volume == 2
    assert brick.i2c(4, np.int64(0x98)).address == 0x98


@pytest.mark.parametrize("way", ["stepped", "threaded"])
@pytest.mark.parametrize(
    ("radius_mm", "angle_deg"), [(300, 90), (300, -60), (-200, 45), (56, 90), (0, 120), (1000, 20)]
)
def test_a_curve_turns_by_its_angle_on_its_circle(lab, radius_mm, angle_deg):
    rover = Rover(lab().brick.link, ultrasonic=None, touch=None)
    result = rover.curve(radius_mm, angle_deg)
    assert result.stop is StopReason.DONE
    assert result.turned_deg == pytest.approx(angle_deg, abs=2)
    assert result.distance_mm == pytest.approx(radius_mm * abs(angle_deg) * 3.14159 / 180, abs=4)
    # the chord of the circle, forward or back, and to the side of the turn
    pose = rover.pose()
    assert (pose.x_mm > 0) == (radius_mm > 0) or not radius_mm
    assert abs(pose.y_mm) < 10 or (pose.y_mm > 0) == (angle_deg * radius_mm > 0)


def test_a_drive_may_have_a_speed_of_its_own(lab):
    def seconds(speed_mm_s):
        room = lab()
        rover = Rover(room.brick.link, ultrasonic=None, touch=None)
        assert rover.straight(400, speed_mm_s).done
        return room.simulation.time_s

    assert seconds(80) > 1.5 * seconds(250)


def test_waiting_for_a_press_waits_for_a_new_one(lab):
    room = lab()
    down = [True]
    room.attach(1, _Button(down))
    touch = room.brick.touch(1)
    assert not touch.wait_for_press(timeout_s=0.5), "it was down all the time"
    room.simulation.at(room.simulation.now_ms + 300, lambda: down.__setitem__(0, False))
    room.simulation.at(room.simulation.now_ms + 700, lambda: down.__setitem__(0, True))
    begun_s = room.brick.now()
    assert touch.wait_for_press(timeout_s=5)
    assert room.brick.now() - begun_s == pytest.approx(0.7, abs=0.05)


class _Button:
    """A touch sensor that a list presses."""

    def __init__(self, down):
        self.down = down

    def raw(self, *_):
        return 200 if self.down[0] else 1023


@pytest.mark.slow
def test_a_mission_is_one_call_that_returns_its_report(tmp_path):
    path = tmp_path / "near.toml"
    path.write_text(
        '[mission]\ntargets = ["lena"]\ntime_limit_s = 8\n'
        '[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'
    )
    states = []
    observers = [lambda record: states.append(record.state)]
    report = nxtdrive.run_mission(path, nxt="sim://open", camera="geometric", observers=observers)
    assert report.ending in ("achieved", "time_up")
    assert [each.target for each in report.targets] == ["lena"]
    assert "search" in states
    assert [each["target"] for each in report.arrivals] == ["lena"] * report.achieved
    assert not report.hints
    with pytest.raises(ConfigError, match="nosuch"):
        nxtdrive.run_mission(tmp_path / "nosuch.toml")
    with pytest.raises(ConfigError, match="daring"):
        nxtdrive.run_mission(path, profile="daring")


def test_the_simulated_robots_camera_opens_as_any_other(lab):
    brick = lab().brick
    frame = open_camera("sim", clock=brick).read(1.0)
    assert frame.image.ndim == 3
    assert frame.time_s <= brick.now()
    assert open_camera("sim").read(1.0).image.any()
    with pytest.raises(CameraError, match="no simulated camera"):
        open_camera("sim", clock=WallClock())
