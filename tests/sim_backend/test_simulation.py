"""The simulation as a whole: clock, brick, sensors and camera."""

import math

import numpy as np
import pytest

from firmware_protocol.direct import (
    GetBatteryLevel,
    GetInputValues,
    GetOutputState,
    LSRead,
    LSWrite,
    SetInputMode,
    SetOutputState,
)
from firmware_protocol.enums import (
    InputPort,
    OutputMode,
    OutputPort,
    RegulationMode,
    RunState,
    SensorMode,
    SensorType,
)
from sim_backend.bundled import PICTURES, WORLDS
from sim_backend.link import SimLink
from sim_backend.simulation import Simulation

REGULATED = OutputMode.MOTOR_ON | OutputMode.BRAKE | OutputMode.REGULATED


def ask(simulation, command):
    reply = simulation.deliver(command.encode())
    simulation.advance(1)
    return type(command).reply_type.unpack(reply) if reply else None


def drive(simulation, left, right):
    for port, power in ((OutputPort.B, left), (OutputPort.C, right)):
        ask(simulation, SetOutputState(port, power, REGULATED, RegulationMode.SPEED, 0, RunState.RUNNING, 0))


def run_of(seed):
    simulation = Simulation("arena", seed=seed)
    track = []
    for left, right in ((50, 50), (40, -40), (60, 55), (0, 0)):
        drive(simulation, left, right)
        simulation.advance(1700)
        track.append((simulation.now_ms, *simulation.truth.pose, simulation.camera_frame().tobytes()))
    return track


def test_the_same_seed_gives_the_same_run_to_the_last_bit():
    assert run_of(3) == run_of(3)
    assert run_of(3) != run_of(4)


def test_time_may_pass_in_any_portions():
    tracks = []
    for portions in ([2000], [1] * 2000, [7] * 285 + [5]):
        simulation = Simulation("open")
        drive(simulation, 60, 50)
        for portion in portions:
            simulation.advance(portion)
        tracks.append((simulation.now_ms, simulation.truth.pose))
    assert tracks[0] == tracks[1] == tracks[2]


def test_regulated_motors_drive_the_robot_as_far_as_they_count():
    simulation = Simulation("open")
    start = simulation.truth.pose
    drive(simulation, 40, 40)
    simulation.advance(3000)
    drive(simulation, 0, 0)
    simulation.advance(500)
    counts = [ask(simulation, GetOutputState(port)).rotation_count for port in (OutputPort.B, OutputPort.C)]
    assert counts[0] == pytest.approx(counts[1], abs=10)
    driven_mm = sum(counts) / 2 * np.pi * 56 / 360
    assert simulation.truth.pose.x_mm - start.x_mm == pytest.approx(driven_mm, rel=0.01)


def test_the_third_motor_turns_without_moving_the_robot():
    simulation = Simulation("open")
    start = simulation.truth.pose
    ask(simulation, SetOutputState(OutputPort.A, 50, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0))
    simulation.advance(1000)
    assert ask(simulation, GetOutputState(OutputPort.A)).rotation_count > 300
    assert simulation.truth.pose == start


def test_the_bumper_is_felt_at_the_brick():
    simulation = Simulation("open")
    ask(simulation, SetInputMode(InputPort.IN_1, SensorType.SWITCH, SensorMode.BOOLEAN))
    simulation.advance(100)
    assert ask(simulation, GetInputValues(InputPort.IN_1)).scaled == 0
    drive(simulation, 60, 60)
    simulation.advance(10_000)
    assert simulation.truth.touching
    assert simulation.truth.contacts == 1
    assert ask(simulation, GetInputValues(InputPort.IN_1)).scaled == 1


def test_the_ultrasonic_sensor_is_read_over_its_bus():
    simulation = Simulation("open")
    ask(simulation, SetInputMode(InputPort.IN_4, SensorType.LOW_SPEED_9V, SensorMode.RAW))
    simulation.advance(100)
    ask(simulation, LSWrite.transaction(InputPort.IN_4, b"\x02\x42", 1))
    simulation.advance(20)
    distance_cm = ask(simulation, LSRead(InputPort.IN_4)).data[0]
    # the picture at 2400 mm, the robot at 400 mm, the sensor 100 mm in front of its axle
    assert distance_cm == pytest.approx(190, abs=3)


def test_the_battery_is_as_full_as_the_world_says():
    simulation = Simulation("open")
    simulation.advance(200)  # the firmware looks every 167 ms
    assert ask(simulation, GetBatteryLevel()).voltage_mv == pytest.approx(8000, abs=14)


def test_a_weaker_battery_is_measured_and_felt():
    ways = []
    for battery_mv in (8000, 6400):
        simulation = Simulation("open")
        simulation.set_battery(battery_mv)
        command = SetOutputState(OutputPort.A, 80, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0)
        ask(simulation, command)
        simulation.advance(1000)
        assert ask(simulation, GetBatteryLevel()).voltage_mv == pytest.approx(battery_mv, abs=14)
        ways.append(ask(simulation, GetOutputState(OutputPort.A)).rotation_count)
    assert ways[1] == pytest.approx(0.8 * ways[0], rel=0.01)


def test_a_frame_is_drawn_once_and_a_new_one_comes_at_the_cameras_rate():
    simulation = Simulation("open")
    frame = simulation.camera_frame()
    assert frame.shape == (240, 320, 3)
    assert simulation.camera_frame() is frame
    simulation.advance(99)
    assert simulation.camera_frame() is frame
    simulation.advance(1)
    assert simulation.webcam.index == 1
    assert simulation.camera_frame() is not frame


def test_frames_show_the_moment_they_were_taken():
    early, late = Simulation("open"), Simulation("open")
    for simulation in (early, late):
        drive(simulation, 80, 80)
        simulation.advance(1002)
    first = early.camera_frame()
    for simulation in (early, late):
        simulation.advance(50)
    assert early.camera_frame() is first
    assert np.array_equal(late.camera_frame(), first)


def test_pictures_are_observed_without_drawing_a_frame():
    simulation = Simulation("open")
    seen = [found for _ in range(20) if (found := simulation.webcam.observe("lena"))]
    assert len(seen) > 15
    focal_px = 160 / math.tan(math.radians(30))
    for (left, top), (right, _), _, (_, bottom) in seen:
        assert (left + right) / 2 == pytest.approx(160, abs=2)
        assert focal_px * 297 / (bottom - top) == pytest.approx(2400 - 400 - 60, rel=0.15)
    assert simulation.webcam.observe("nobody") is None
    drive(simulation, 40, -40)
    simulation.advance(900)
    assert simulation.truth.pose.heading_deg == pytest.approx(150, abs=60)
    assert not any(simulation.webcam.observe("lena") for _ in range(20))


def test_a_picture_from_a_file_is_observed_by_its_name(tmp_path):
    open_world = (WORLDS / "open.toml").read_text()
    (tmp_path / "cat.png").write_bytes((PICTURES / "fox.png").read_bytes())
    (tmp_path / "cat.toml").write_text(open_world.replace('"lena"', '"cat"\nfile = "cat.png"'))
    simulation = Simulation(tmp_path / "cat.toml")
    assert any(simulation.webcam.observe("cat") for _ in range(5))
    assert simulation.camera_frame() is not None


def test_an_unplugged_camera_gives_no_frame():
    simulation = Simulation("open")
    simulation.webcam.unplugged_ms = ((100, 200),)
    assert simulation.camera_frame() is not None
    simulation.advance(150)
    assert simulation.camera_frame() is None
    assert simulation.webcam.observe("lena") is None
    simulation.advance(50)
    assert simulation.camera_frame() is not None


def test_a_recorder_gets_frames_while_time_passes():
    simulation = Simulation("open", camera_size=(64, 48))
    seen = []
    simulation.on_frame(lambda frame, time_s: seen.append((frame.shape, time_s)), fps=8)
    simulation.advance(500)
    assert seen == [((48, 64, 3), time_s) for time_s in (0, 0.125, 0.25, 0.375, 0.5)]


def test_the_arena_hides_lena_until_the_robot_has_moved_off():
    simulation = Simulation("arena")
    seen = set()
    drive(simulation, 20, -20)
    while simulation.truth.pose.heading_deg < 360:
        simulation.advance(100)
        seen |= {name for name in ("lena", "rilakkuma") if simulation.truth.in_view(name)}
    assert seen == set()


def test_actions_happen_at_their_time_in_the_order_of_the_calls():
    simulation = Simulation("open")
    log = []
    simulation.at(20, lambda: log.append(("b", simulation.now_ms)))
    simulation.at(5, lambda: log.append(("a", simulation.now_ms)))
    simulation.at(20, lambda: log.append(("c", simulation.now_ms)))
    simulation.advance(30)
    assert log == [("a", 5), ("b", 20), ("c", 20)]


def test_a_brick_that_has_gone_to_sleep_is_silent():
    simulation = Simulation("open")
    link = SimLink(simulation)
    simulation.advance(11 * 60_000)
    link.send(GetBatteryLevel().encode())
    assert link.receive(1000) is None
