"""An unmodified outside client, nxt-python, in a process of its own, at the pseudo-terminal."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(find_spec("nxt") is None, reason="nxt-python is not installed (pip install .[test])")

PROGRAM = """
import sys
import nxt.locator, nxt.motor, nxt.sensor, nxt.sensor.generic
with nxt.locator.find(backends=["devfile"], filename=sys.argv[1]) as brick:
    motor = brick.get_motor(nxt.motor.Port.A)
    motor.turn(75, 360)
    print("turned", motor.get_tacho().tacho_count)
    sensor = brick.get_sensor(nxt.sensor.Port.S4)
    print("found", type(sensor).__name__)
    print("distances", *(sensor.get_distance() for _ in range(15)))
"""


def _run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_its_test_program_is_content(served):
    program = Path(sys.executable).with_name("nxt-test")
    text = _run(program, "--backend", "devfile", "--filename", served.path)
    assert "Firmware version 1.29" in text
    assert "Battery level" in text


def test_motors_and_digital_sensors_work(served):
    rows = dict(line.split(" ", 1) for line in _run(sys.executable, "-c", PROGRAM, served.path).splitlines())
    assert 250 < int(rows["turned"]) < 550
    assert rows["found"] == "Ultrasonic"
    assert len([int(distance) for distance in rows["distances"].split()]) == 15
