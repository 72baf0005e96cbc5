"""A virtual SDL gamepad: plugged in, moved and unplugged; read like a real one, and driving a robot."""

import os
import signal
import subprocess
import sys

import pytest

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import USAGE
from nxtdrive.tools.teleop.sticks import Sticks
from tests.tools.teleop.on_screen import app_of, play, text, until, until_panel

LEFT_X, LEFT_Y, RIGHT_X = range(3)
A, B, LB, RB, UP, DOWN, LEFT, RIGHT = 0, 1, 9, 10, 11, 12, 13, 14
"""Of the virtual gamepad."""
STICK_ONLY = 0
"""SDL's kind of joystick that has no layout."""


def test_it_says_that_none_is_connected(pad):
    gamepad, _ = pad
    reading = gamepad.read()
    assert reading.words == "none connected"
    assert reading.sticks is None


def test_sticks_and_cross_are_read(pad):
    gamepad, virtual = pad
    virtual.plug()
    assert gamepad.read().sticks == Sticks()
    virtual.move(LEFT_Y, -1.0)
    virtual.move(RIGHT_X, 0.5)
    virtual.press(LEFT)
    virtual.press(DOWN)
    reading = gamepad.read()
    assert reading.sticks == Sticks(left_y=-1.0, right_x=pytest.approx(0.5, abs=1e-4), cross_x=-1, cross_y=1)
    assert gamepad.read().sticks == reading.sticks


def test_a_button_counts_once_however_short_it_was_pressed(pad):
    from nxtdrive.tools.teleop.gamepad import Button

    gamepad, virtual = pad
    virtual.plug()
    gamepad.read()
    for button, meaning in ((B, Button.STOP), (A, Button.RELEASE), (RB, Button.FASTER), (LB, Button.SLOWER)):
        virtual.press(button)
        assert gamepad.read().pressed == (meaning,)
        assert gamepad.read().pressed == ()
        virtual.press(button, down=False)
        assert gamepad.read().pressed == ()


def test_unplugging_is_reported_once_and_plugging_in_again_works(pad):
    gamepad, virtual = pad
    virtual.plug()
    connected = gamepad.read().words
    virtual.move(LEFT_Y, -1.0)
    virtual.unplug()
    reading = gamepad.read()
    assert reading.lost
    assert reading.sticks is None
    assert "UNPLUGGED" in reading.words
    assert not gamepad.read().lost
    virtual.plug()
    reading = gamepad.read()
    assert reading.words == connected
    assert reading.sticks == Sticks()
    assert not reading.lost


def test_what_has_no_layout_is_named_and_left_alone(pad):
    gamepad, virtual = pad
    virtual.plug(STICK_ONLY)
    reading = gamepad.read()
    assert "unknown layout" in reading.words
    assert reading.sticks is None
    virtual.unplug()
    assert gamepad.read().words == "none connected"


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no signals as POSIX has them")
def test_signals_stay_the_programs_own():
    pytest.importorskip("pygame", reason="pygame-ce is not installed (pip install 'nxtdrive[gamepad]')")
    program = (
        "import os, signal; from nxtdrive.tools.teleop.gamepad import Gamepad;"
        "gamepad = Gamepad(); os.kill(os.getpid(), signal.SIGTERM); gamepad.read()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == -signal.SIGTERM
    assert done.stdout + done.stderr == ""


def test_without_pygame_it_names_the_command(monkeypatch):
    from nxtdrive.tools.teleop.gamepad import Gamepad

    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(ConfigError) as refusal:
        Gamepad()
    assert "install 'nxtdrive[gamepad]'" in str(refusal.value)


WITHOUT_PYGAME = "import sys; sys.modules['pygame'] = None; from nxtdrive.cli.main import main; sys.exit(main())"


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")
def test_asked_for_a_gamepad_without_pygame_teleop_says_what_to_install():
    master, slave = os.openpty()
    try:
        done = subprocess.run(
            [sys.executable, "-c", WITHOUT_PYGAME, "teleop", "--gamepad"],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            check=False,
            timeout=60,
        )
        shown = os.read(master, 10_000).decode()
    finally:
        os.close(master)
        os.close(slave)
    assert done.returncode == USAGE
    assert "install 'nxtdrive[gamepad]'" in shown


@pytest.mark.slow
def test_not_asked_for_one_teleop_does_without_pygame(terminal):
    screen = terminal(sys.executable, "-c", WITHOUT_PYGAME, "teleop")
    screen.wait("at rest")
    assert "off (--gamepad)" in screen.wait("driving", "Up")
    screen.keys("Escape")
    screen.wait_for_the_end()


@pytest.fixture
def teleop(room, pad):
    """(simulation, app, virtual gamepad) in real time."""
    gamepad, virtual = pad
    simulation, brick = room(realtime=True)
    return simulation, app_of(brick, gamepad), virtual


def _play(app, act):
    async def rested(pilot):
        await until_panel(pilot, "at rest")
        await act(pilot)

    play(app, rested)
    assert app.failure is None


@pytest.mark.slow
def test_the_stick_drives_as_long_as_it_is_held_and_its_middle_stops(teleop):
    simulation, app, virtual = teleop
    start = simulation.truth.pose

    async def act(pilot):
        virtual.plug()
        await until_panel(pilot, "Virtual")
        virtual.move(LEFT_Y, -1.0)
        await until(pilot, lambda: simulation.truth.pose.x_mm > start.x_mm + 250)
        assert "driving" in text(app, "panel")
        virtual.move(LEFT_Y, 0.0)
        await until_panel(pilot, "at rest")

    _play(app, act)


@pytest.mark.slow
def test_unplugging_stops_with_the_stick_held_and_plugging_in_drives_again(teleop):
    _, app, virtual = teleop

    async def act(pilot):
        for axis in (LEFT_X, RIGHT_X):
            virtual.plug()
            await until_panel(pilot, "Virtual")
            virtual.move(axis, 1.0)
            await until_panel(pilot, "driving")
            virtual.unplug()
            await until(pilot, lambda: "at rest" in text(app, "panel") and "UNPLUGGED" in text(app, "panel"))

    _play(app, act)


@pytest.mark.slow
def test_b_is_an_emergency_stop_a_ends_it_and_shoulders_change_the_speed(teleop):
    _, app, virtual = teleop

    async def act(pilot):
        virtual.plug()
        await until_panel(pilot, "Virtual")
        virtual.press(RB)
        await until_panel(pilot, "(70 %)")
        virtual.press(LB)
        await until_panel(pilot, "(60 %)")
        virtual.move(RIGHT_X, 1.0)
        await until_panel(pilot, "driving")
        virtual.press(B)
        await until_panel(pilot, "EMERGENCY")
        virtual.press(A)
        await until_panel(pilot, "at rest")
        await pilot.pause(0.3)
        assert "at rest" in text(app, "panel"), "the stick is still held, and has not been in the middle"
        virtual.move(RIGHT_X, 0.0)
        await pilot.pause(0.1)
        virtual.move(RIGHT_X, 1.0)
        await until_panel(pilot, "driving")

    _play(app, act)
