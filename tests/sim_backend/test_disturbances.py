"""Events of the robot itself: devices that fail, wheels that slip, a turned camera, and being lifted."""

from contextlib import suppress

import cv2
import numpy as np
import pytest

from nxtdrive.brick import Brick
from nxtdrive.errors import NXTError
from nxtdrive.transports.sim import SimTransport
from nxtdrive.vision.frames import is_black
from sim_backend.simulation import Simulation
from sim_backend.world.event_tables import Event
from sim_backend.world.loading import parse_world
from sim_backend.world.world_file import WorldFile

FREE_MM = 1500.0


def room(*events, **tables):
    return {
        "floor": {"size_mm": (4000, 3000)},
        "robot": {"start_mm": (1000, 1500), "slip": {"jitter_percent": 0}, "motor_mismatch_percent": 0},
        "ultrasonic": {"noise_mm": 0.0},
        "walls": [{"from_mm": (2600, 500), "to_mm": (2600, 2500)}],
        "events": [{"name": f"event {number}", **event} for number, event in enumerate(events)],
        **tables,
    }


def simulate(*events):
    return Simulation(WorldFile.model_validate(room(*events)))


def fails(fault, at_s=1.0, sensor=4, **more):
    return {"when": {"at_s": at_s}, "sensor": sensor, "fault": fault, **more}


def echo_mm(brick):
    return brick.ultrasonic(4).distance_mm


def test_a_dead_sonar_has_no_echo_until_it_recovers():
    with Brick(SimTransport(simulate(fails("no_echo", stays_s=2)))) as brick:
        assert echo_mm(brick) == pytest.approx(FREE_MM, abs=20)
        brick.sleep(1.2)
        assert echo_mm(brick) is None
        brick.sleep(2.0)
        assert echo_mm(brick) == pytest.approx(FREE_MM, abs=20)


def test_a_stuck_sonar_repeats_its_last_echo():
    simulation = simulate(fails("stuck"))
    with Brick(SimTransport(simulation)) as brick:
        before = echo_mm(brick)
        brick.sleep(1.2)
        simulation.world.place_robot((2000, 1500), 0)
        brick.sleep(0.1)
        assert echo_mm(brick) == before


def test_an_unplugged_sonar_is_an_error():
    with Brick(SimTransport(simulate(fails("unplugged")))) as brick:
        brick.sleep(1.2)
        with pytest.raises(NXTError):
            echo_mm(brick)


def test_a_loose_plug_loses_some_of_the_requests():
    answered = 0
    with Brick(SimTransport(simulate(fails("error", at_s=0)))) as brick:
        brick.sleep(0.2)
        for _ in range(40):
            with suppress(NXTError):
                answered += echo_mm(brick) == pytest.approx(FREE_MM, abs=20)
    assert 2 < answered < 38


@pytest.mark.parametrize("fault", ["stuck", "unplugged"])
def test_a_bumper_that_fails_is_never_pressed(fault):
    simulation = simulate(fails(fault, at_s=0, sensor=1))
    with Brick(SimTransport(simulation)) as brick:
        bumper = brick.touch(1)
        assert not bumper.pressed
        brick.sleep(0.2)
        simulation.world.place_robot((2480, 1500), 0)
        brick.motor("B").run(speed_deg_s=200)
        brick.motor("C").run(speed_deg_s=200)
        brick.sleep(1.0)
        assert simulation.truth.touching
        assert not bumper.pressed


def test_a_bumper_that_sticks_stays_pressed():
    with Brick(SimTransport(simulate(fails("pressed", sensor=1, stays_s=2)))) as brick:
        assert not brick.touch(1).pressed
        brick.sleep(1.2)
        assert brick.touch(1).pressed
        brick.sleep(2.0)
        assert not brick.touch(1).pressed


@pytest.mark.parametrize(
    ("wheel", "turns"), [("left", (False, True)), ("right", (True, False)), ("both", (False, False))]
)
def test_a_motor_without_its_cable_neither_drives_nor_counts_until_it_is_plugged_in_again(wheel, turns):
    unplugged = {"when": {"at_s": 1}, "wheel": wheel, "fault": "unplugged", "stays_s": 3}
    simulation = simulate(unplugged)
    with Brick(SimTransport(simulation)) as brick:
        motors = [brick.motor(port) for port in "BC"]
        drive(brick, 2.0)
        before = [motor.angle for motor in motors]
        assert min(before) > 100
        pose = simulation.truth.pose
        brick.sleep(1.0)
        after = [motor.angle for motor in motors]
        assert tuple(now > then + 100 for then, now in zip(before, after, strict=True)) == turns
        assert [now == then for then, now in zip(before, after, strict=True)] == [not each for each in turns]
        moved = simulation.truth.pose.heading_deg - pose.heading_deg
        assert (moved > 10, moved < -10) == (turns == (True, False), turns == (False, True))
        brick.sleep(2.0)
        again = [motor.angle for motor in motors]
        drive(brick, 1.0)
        assert all(motor.angle > then + 100 for motor, then in zip(motors, again, strict=True))


def frames(simulation, times):
    images = []
    for _ in range(times):
        simulation.advance(100)
        images.append(simulation.camera_frame())
    return images


def camera_fails(**event):
    simulation = simulate({"when": {"at_s": 0.5}, "camera": True, "stays_s": 1, **event})
    simulation.advance(300)
    return simulation


def test_a_stuck_camera_repeats_its_last_frame():
    simulation = camera_fails(fault="stuck")
    first, *_ = frames(simulation, 1)
    simulation.advance(200)
    simulation.world.place_robot((2000, 1000), 90)
    stuck = frames(simulation, 3)
    assert all(np.array_equal(image, stuck[0]) for image in stuck)
    assert np.abs(stuck[0].astype(int) - first).mean() < 10, "the view before the robot was moved"
    simulation.advance(1000)
    one, other = frames(simulation, 2)
    assert not np.array_equal(one, other)
    assert np.abs(one.astype(int) - first).mean() > 10


@pytest.mark.parametrize(
    ("fault", "dark", "plain"), [("covered", True, True), ("fogged", False, True), (None, False, False)]
)
def test_a_covered_camera_gives_black_frames_and_a_fogged_one_no_edges(fault, dark, plain):
    simulation = camera_fails(fault=fault) if fault else simulate()
    simulation.advance(500)
    image = simulation.camera_frame()
    assert is_black(image) is dark
    assert bool(cv2.Canny(image, 50, 150).mean() < 0.5) is plain
    assert simulation.webcam.unplugged is dark, "geometric vision has no pixels: black frames are none"


def test_an_unplugged_camera_gives_no_frames_until_it_is_back():
    simulation = camera_fails(fault="unplugged")
    assert simulation.camera_frame() is not None
    simulation.advance(500)
    assert simulation.camera_frame() is None
    simulation.advance(1000)
    assert simulation.camera_frame() is not None


def test_a_camera_that_is_turned_looks_elsewhere():
    simulation = camera_fails(yaw_deg=15)
    before = simulation.world.viewpoint().heading_deg
    simulation.advance(500)
    assert simulation.world.viewpoint().heading_deg == pytest.approx(before + 15)
    simulation.advance(1000)
    assert simulation.world.viewpoint().heading_deg == pytest.approx(before)


def drive(brick, seconds, speed_deg_s=300):
    for port in "BC":
        brick.motor(port).run(speed_deg_s=speed_deg_s)
    brick.sleep(seconds)


def test_a_lifted_robot_is_put_down_elsewhere_and_its_wheels_only_count():
    lift = {"when": {"at_s": 1}, "robot": True, "to_mm": (500, 700), "facing_deg": 90, "stays_s": 2}
    simulation = simulate(lift)
    with Brick(SimTransport(simulation)) as brick:
        drive(brick, 2.0)
        assert simulation.world.robot.lifted
        assert echo_mm(brick) is None
        assert not simulation.truth.touching
        brick.motor("B").stop()
        brick.motor("C").stop()
        brick.sleep(1.5)
        assert not simulation.world.robot.lifted
        assert simulation.truth.pose == pytest.approx((500, 700, 90), abs=1)
        assert brick.motor("B").angle > 400
        drive(brick, 1.0)
        assert simulation.truth.pose.y_mm > 800


def test_a_lifted_robot_passes_over_walls():
    lift = {"when": {"at_s": 0.5}, "robot": True, "to_mm": (3500, 1500), "stays_s": 1}
    simulation = simulate(lift)
    simulation.advance(2000)
    assert simulation.truth.pose == pytest.approx((3500, 1500, 0), abs=1)
    assert simulation.truth.contacts == 0


@pytest.mark.parametrize(("wheel", "turns"), [("left", -1), ("right", 1), ("both", 0)])
def test_a_wheel_that_slips_drives_less_and_counts_the_same(wheel, turns):
    simulation = simulate({"when": {"at_s": 0}, "wheel": wheel, "slip_percent": 50, "stays_s": 1.5})
    with Brick(SimTransport(simulation)) as brick:
        brick.sleep(0.2)
        drive(brick, 1.0)
        heading_deg = simulation.truth.pose.heading_deg
        assert (heading_deg > 10) - (heading_deg < -10) == turns
        counted_mm = brick.motor("B").angle * 56 * 3.1416 / 360
        assert simulation.truth.pose.x_mm - 1000 < 0.8 * counted_mm
        brick.sleep(1.0)
        before = simulation.truth.pose.heading_deg
        brick.sleep(0.5)
        assert simulation.truth.pose.heading_deg == pytest.approx(before, abs=1)


def test_a_later_fault_of_a_sensor_ends_the_earlier_one():
    stuck, unplugged = fails("stuck", stays_s=2), fails("unplugged", at_s=2, stays_s=60)
    simulation = simulate(stuck, unplugged, {"when": {"after_end_of": "event 0"}, "sensor": 1, "fault": "stuck"})
    simulation.advance(2_500)
    assert simulation.world.disturbances.faults == {4: "unplugged", 1: "stuck"}
    simulation.advance(1_500)
    assert simulation.world.disturbances.faults == {4: "unplugged", 1: "stuck"}


def test_a_later_slip_of_a_wheel_ends_the_earlier_one_of_both_only_there():
    slip = {"slip_percent": 50, "stays_s": 3}
    simulation = simulate(
        {"when": {"at_s": 1}, "wheel": "both", **slip}, {"when": {"at_s": 2}, "wheel": "left", **slip}
    )
    with Brick(SimTransport(simulation)) as brick:
        brick.sleep(4.3)
        before = simulation.world.robot.heading_deg
        drive(brick, 0.5)
        assert simulation.world.robot.heading_deg < before - 5


def test_a_robot_that_is_lifted_again_is_carried_on_from_where_it_is():
    lift = {"robot": True, "to_mm": (3000, 1500)}
    simulation = simulate(
        {"when": {"at_s": 1}, "stays_s": 2, **lift},
        {"when": {"at_s": 2}, "stays_s": 4, **lift, "to_mm": (500, 500)},
    )
    simulation.advance(2_000)
    assert simulation.world.robot.x_mm == pytest.approx(2000, abs=50)
    simulation.advance(1_500)
    assert simulation.world.robot.lifted
    assert simulation.world.robot.x_mm == pytest.approx(2000 - 1500 * 1.5 / 4, abs=50)
    simulation.advance(3_000)
    assert not simulation.world.robot.lifted


def test_an_event_can_wait_for_the_end_of_a_fault():
    later = {"when": {"after_end_of": "event 0"}, "sensor": 1, "fault": "stuck"}
    simulation = simulate(fails("no_echo", stays_s=1), later)
    simulation.advance(3000)
    assert [(round(time_s, 1), name) for time_s, name in simulation.truth.events] == [
        (1.0, "event 0"),
        (pytest.approx(2.0, abs=0.2), "event 1"),
    ]


@pytest.mark.parametrize(
    ("event", "complaint"),
    [
        ({"sensor": 4}, "a sensor needs a fault: no_echo, pressed, stuck"),
        ({"sensor": 4, "fault": "covered"}, "a sensor needs a fault"),
        ({"wheel": "left"}, "a wheel needs slip_percent or fault"),
        ({"wheel": "left", "slip_percent": 3, "fault": "unplugged"}, "a wheel needs slip_percent or fault"),
        ({"wheel": "left", "fault": "stuck"}, "the fault of a wheel is unplugged"),
        ({"camera": True}, "the camera needs fault or yaw_deg"),
        ({"camera": True, "fault": "error"}, "fault is one of stuck, covered, fogged, unplugged"),
        ({"camera": True, "fault": "stuck", "to_mm": (1, 1)}, "to_mm is not for"),
        ({"sensor": 4, "fault": "stuck", "yaw_deg": 3}, "yaw_deg is for the camera"),
        ({"sensor": 4, "fault": "stuck", "slip_percent": 3}, "slip_percent is for wheels"),
        ({"robot": True}, "robot needs to_mm"),
        ({"sensor": 4, "wheel": "left", "fault": "stuck", "slip_percent": 3}, "exactly one of person, picture, box"),
        ({"robot": True, "to_mm": (1, 1), "fault": "stuck"}, "fault is for sensors, wheels and the camera"),
        ({"wheel": "both", "slip_percent": 9, "to_mm": (1, 1)}, "to_mm is not for sensors, wheels"),
    ],
)
def test_an_incomplete_disturbance_is_refused(event, complaint):
    with pytest.raises(ValueError, match=complaint):
        Event.model_validate({"name": "it", "when": {"at_s": 1}, **event})


@pytest.mark.parametrize(
    ("event", "complaint"),
    [
        (fails("stuck", sensor=2), r"events\[0\].sensor: there is no sensor at port 2"),
        (fails("no_echo", sensor=1), "no_echo is for ultrasonic sensors; at port 1 is a touch sensor"),
        (fails("pressed"), "pressed is for touch sensors; at port 4 is a ultrasonic sensor"),
        (fails("stuck", sensor=3), "a colour sensor cannot fail yet"),
    ],
)
def test_a_fault_of_a_sensor_that_cannot_have_it_is_refused(event, complaint, tmp_path):
    sensors = [{"kind": "color", "port": 3, "at_mm": (0, 0)}]
    with pytest.raises(ValueError, match=complaint):
        parse_world(room(event, sensors=sensors), tmp_path / "world.toml")
