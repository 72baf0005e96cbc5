"""nxt-python and its programs, as they are, through each kind of door."""

from importlib.util import find_spec

import pytest

DRAW = """
import nxt.locator, sys
with nxt.locator.find(**where) as brick:
    picture = bytes.fromhex(%r)
    for i in range(0, len(picture), 32):
        brick.write_io_map(0x000A0001, 119 + i, picture[i : i + 32])
"""
TURN = """
import nxt.locator, nxt.motor
with nxt.locator.find(**where) as brick:
    motor = brick.get_motor(nxt.motor.Port.B)
    motor.turn(75, 360)
    print(motor.get_tacho().rotation_count)
"""
MEASURE = """
import nxt.locator, nxt.sensor, nxt.sensor.generic
with nxt.locator.find(**where) as brick:
    sensor = brick.get_sensor(nxt.sensor.Port.S4)
    print(type(sensor).__name__, *(sensor.get_distance() for _ in range(15)))
"""
BURST = """
import nxt.locator, nxt.motor
with nxt.locator.find(**where) as brick:
    idle = 0, nxt.motor.Mode(0), nxt.motor.RegulationMode.IDLE, 0, nxt.motor.RunState.IDLE, 0
    for _ in range(200):
        brick.set_output_state(nxt.motor.Port.A, *idle)
    print(brick.get_output_state(nxt.motor.Port.C)[0].name)
"""
FILES = """
import nxt.locator
with nxt.locator.find(**where) as brick:
    with brick.open_file("notes.txt", "r") as file:
        print(file.read(), end="")
    print(*(name for name, size in brick.find_files("*.txt")))
"""


@pytest.mark.slow
def test_its_own_test_program_passes(rig):
    text = rig.plug.tool("nxt-test")
    assert "Firmware version 1.29" in text
    assert "Host address: 00:16:53:01:02:03" in text
    assert "Battery level 8" in text


@pytest.mark.slow
def test_a_file_pushed_arrives_intact(rig, tmp_path):
    content = bytes(i * 7 % 251 for i in range(3000))
    (tmp_path / "data.bin").write_bytes(content)
    for _ in range(2):  # the second time it replaces the first
        assert "done." in rig.plug.tool("nxt-push", str(tmp_path / "data.bin"))
    with rig.halted() as simulation:
        loader = simulation.brick.loader
        opened = loader.open_read("data.bin")
        assert opened.size == len(content)
        assert loader.read(opened.handle, opened.size)[1] == content


def test_a_file_is_read_back_and_found(rig, tmp_path):
    text = "".join(f"line {i}\n" for i in range(100))
    (tmp_path / "notes.txt").write_text(text)
    rig.plug.tool("nxt-push", str(tmp_path / "notes.txt"))
    assert rig.plug.script(FILES) == f"{text}notes.txt\n"


@pytest.mark.slow
@pytest.mark.skipif(find_spec("PIL") is None, reason="nxt-screenshot needs Pillow (pip install pillow)")
def test_a_screenshot_is_what_the_display_shows(rig, tmp_path):
    import cv2
    import numpy as np

    pixels = np.random.default_rng(1).integers(0, 2, (64, 100), dtype=np.uint8)
    # eight lines make one line of bytes, the uppermost pixel in the lowest bit
    lines = np.packbits(pixels.reshape(8, 8, 100), axis=1, bitorder="little")
    rig.plug.script(DRAW % lines.tobytes().hex())
    rig.plug.tool("nxt-screenshot", str(tmp_path / "shot.png"))
    shot = cv2.imread(str(tmp_path / "shot.png"), cv2.IMREAD_GRAYSCALE)
    assert np.array_equal(shot, np.where(pixels, 0, 255))


@pytest.mark.slow
def test_turning_a_motor_moves_the_robot(rig):
    with rig.halted() as simulation:
        before_deg = simulation.truth.pose.heading_deg
    counted_deg = int(rig.plug.script(TURN))
    assert 250 < counted_deg < 550
    with rig.halted() as simulation:
        file = simulation.world.file.robot
        turned_deg = simulation.truth.pose.heading_deg - before_deg
    # the left wheel alone turns the robot to the right, about the other wheel
    expected_deg = counted_deg * file.wheel_diameter_mm / 2 / file.track_mm
    assert turned_deg == pytest.approx(expected_deg, rel=0.25)


@pytest.mark.slow
def test_the_ultrasonic_sensor_is_recognised_and_measures_the_true_distance(rig):
    name, *distances = rig.plug.script(MEASURE).split()
    assert name == "Ultrasonic"
    with rig.halted() as simulation:
        file = simulation.world.file
    sensor_x_mm = file.robot.start_mm[0] + file.ultrasonic.forward_mm
    true_cm = (file.pictures[0].at_mm[0] - sensor_x_mm) / 10  # straight ahead, and facing the robot
    assert [int(cm) for cm in distances] == pytest.approx([true_cm] * 15, abs=3)


@pytest.mark.slow
def test_a_burst_of_commands_without_replies_loses_nothing(rig):
    assert rig.plug.script(BURST) == "C\n"
