"""The program as a user starts it, in a real terminal, with an Xbox 360 gamepad among the system's input devices."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from nxtdrive.cli.commands.sim_exec import umockdev_interpreter

SCRIPT = Path(__file__).with_name("evdev_gamepad.py")
LEFT_Y, RIGHT_X = 1, 3
A, B, RB = 0x130, 0x131, 0x137
"""Codes of Linux's xpad driver."""

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/dev/input is Linux's"),
    pytest.mark.skipif(find_spec("pygame") is None, reason="no pygame-ce (pip install 'nxtdrive[gamepad]')"),
    pytest.mark.skipif(
        umockdev_interpreter() is None, reason="no umockdev (Debian: apt install python3-gi gir1.2-umockdev-1.0)"
    ),
]


@pytest.fixture
def orders(tmp_path):
    """(FIFO, what puts an order to the gamepad into it)."""
    fifo = tmp_path / "gamepad"
    os.mkfifo(fifo)
    opened = os.open(fifo, os.O_RDWR)  # does not wait for the reader
    yield fifo, lambda order: os.write(opened, f"{order}\n".encode())
    os.close(opened)


def test_a_gamepad_drives_is_pulled_out_and_plugged_in_again(terminal, orders):
    fifo, say = orders
    screen = terminal(
        *("env", "LD_PRELOAD=libumockdev-preload.so.0", umockdev_interpreter(), str(SCRIPT), str(fifo)),
        *(sys.executable, "-m", "nxtdrive", "teleop", "--gamepad"),
    )
    screen.wait("none connected")
    say("plug")
    screen.wait("X360 Controller")
    say(f"axis {LEFT_Y} -32768")
    screen.wait("+180 mm/s")
    say("unplug")
    screen.wait("UNPLUGGED")
    screen.wait("state    at rest")
    say("plug")
    screen.wait("X360 Controller")
    say(f"key {RB} 1")
    screen.wait("(70 %)")
    say(f"axis {RIGHT_X} 32767")
    screen.wait("driving")
    say(f"key {B} 1")
    screen.wait("EMERGENCY")
    say(f"axis {RIGHT_X} 0")
    say(f"key {A} 1")
    screen.wait("state    at rest")
    say(f"axis {LEFT_Y} 32767")
    screen.wait("-210 mm/s")
    screen.keys("Escape")
    screen.wait_for_the_end()
