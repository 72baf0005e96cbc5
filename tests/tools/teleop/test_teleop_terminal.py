"""The screen: textual's pilot presses keys, and the program runs in a real terminal."""

import asyncio
import io
import math
import os
import sys
from contextlib import suppress

import pytest

from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from nxtdrive.tools.teleop.controls import Controls
from nxtdrive.tools.teleop.pilot import Pilot
from nxtdrive.tools.teleop.spotter import Spotter
from nxtdrive.tools.teleop.terminal import TolerantStream
from tests.small_mission import MISSION
from tests.tools.teleop.on_screen import app_of, play, text, until, until_panel


class _Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def teleop(room):
    """Makes (simulation, app) on a robot in real time."""

    def make(**options):
        simulation, brick = room(realtime=True)
        return simulation, app_of(brick, **options)

    return make


@pytest.mark.slow
def test_keys_drive_and_letting_go_stops(teleop):
    simulation, app = teleop()
    start = simulation.truth.pose

    async def act(pilot):
        await until_panel(pilot, "at rest")
        await until_panel(pilot, "driving", key="up")
        await until(pilot, lambda: simulation.truth.pose.x_mm > start.x_mm + 250, key="up")
        await until_panel(pilot, "at rest")
        assert "·" in text(app, "map")

    play(app, act)
    assert app.failure is None


@pytest.mark.slow
def test_letters_drive_and_halt_with_caps_lock_as_well(teleop):
    controls = Controls(300.0, 120.0)
    _, app = teleop(controls=controls)

    async def act(pilot):
        await until_panel(pilot, "driving", key="W")
        controls.steer(0.0, 0.0, math.inf)
        controls.steer(1.0, 0.0, math.inf)  # never old
        await until_panel(pilot, "driving")
        await pilot.press("X")
        await until_panel(pilot, "at rest")

    play(app, act)


@pytest.mark.slow
def test_space_stops_at_once_and_stays_until_enter(teleop):
    _, app = teleop()

    async def act(pilot):
        await until_panel(pilot, "driving", key="d")
        await pilot.press("space")
        await until_panel(pilot, "EMERGENCY")
        await pilot.press("d")
        await pilot.pause(0.3)
        assert "EMERGENCY" in text(app, "panel")
        await pilot.press("enter")
        await until_panel(pilot, "at rest")

    play(app, act)


@pytest.mark.slow
def test_plus_and_minus_change_the_speed(teleop):
    _, app = teleop()

    async def act(pilot):
        await until_panel(pilot, "(60 %)")
        await pilot.press("plus")
        await until_panel(pilot, "(70 %)")
        await pilot.press("minus", "minus")
        await until_panel(pilot, "(50 %)")

    play(app, act)


@pytest.mark.slow
def test_a_screen_that_closes_slowly_shows_nothing_more(teleop):
    from textual.widget import Widget

    class SlowToClose(Widget):
        async def on_unmount(self):
            await asyncio.sleep(0.3)  # several ticks of the picture

    _, app = teleop()

    async def act(pilot):
        await until_panel(pilot, "at rest")
        await app.mount(SlowToClose())

    play(app, act)


@pytest.mark.slow
def test_leaving_stops_the_robot(teleop):
    simulation, app = teleop()

    async def act(pilot):
        await until_panel(pilot, "driving", key="w")
        await pilot.press("escape")
        await until(pilot, lambda: not app.is_running)

    play(app, act)
    simulation.advance(300)
    rest = simulation.truth.pose
    simulation.advance(1000)
    assert simulation.truth.pose == pytest.approx(rest, abs=1.0)


@pytest.mark.slow
def test_a_lost_link_ends_it_with_the_reason(teleop):
    simulation, app = teleop()

    async def act(pilot):
        await until_panel(pilot, "at rest")
        simulation.brick.receive = lambda telegram: None
        await until(pilot, lambda: not app.is_running)

    play(app, act)
    assert app.failure is not None


@pytest.mark.slow
def test_a_defect_of_the_pilot_ends_it_too(teleop, monkeypatch):
    _, app = teleop()

    async def act(pilot):
        await until_panel(pilot, "at rest")
        monkeypatch.setattr(Pilot, "step", lambda self: 1 / 0)
        await until(pilot, lambda: not app.is_running)

    play(app, act)
    assert isinstance(app.failure, ZeroDivisionError)


def test_a_detector_that_breaks_while_it_drives_stops_the_robot(room):
    from nxtdrive.tools.teleop.app import Teleop

    class Blind:
        def look(self, target):
            if driven:
                raise ZeroDivisionError("a detector's bug")

    _, brick = room()
    driven = []
    controls = Controls(300.0, 120.0)
    controls.steer(0.0, 0.0, math.inf)
    controls.steer(0.0, 1.0, math.inf)  # never old
    pilot = Pilot(brick, brick.rover(), controls, Spotter(Blind(), "lena"))
    pilot.step()
    driven.append(brick.request(GetOutputState(OutputPort.B)).power)
    app = Teleop(pilot, controls, brick.now, "sim://")

    async def act(screen):
        await until(screen, lambda: app.failure is not None)

    play(app, act)
    assert driven[0] > 0
    assert brick.request(GetOutputState(OutputPort.B)).power == 0


def test_a_mission_brings_its_own_room(tmp_path, monkeypatch, refused):
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)
    (tmp_path / "small.toml").write_text(MISSION, encoding="utf-8")
    (tmp_path / "small-world.toml").write_text("[flor]\n", encoding="utf-8")  # so that it ends when it opens that
    assert "small-world.toml has 3 mistakes" in refused("teleop", "--no-gamepad", "--mission", tmp_path / "small.toml")


def test_without_a_terminal_it_says_so(refused):
    assert "terminal" in refused("teleop")


def test_without_textual_it_names_the_command(refused, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert "install 'nxtdrive[tui]'" in refused("teleop")


def test_drawing_on_a_terminal_that_has_been_closed_raises_nothing():
    """It would end textual's thread that draws, for which the program would wait forever."""
    reader, writer = os.pipe()
    os.close(reader)
    with suppress(BrokenPipeError), open(writer, "w") as closed:
        drawing = TolerantStream(closed)
        for _ in range(3):
            assert drawing.write("x" * 10_000) == 10_000
            drawing.flush()
    drawing.flush()


def test_a_standard_error_that_is_not_a_terminal_is_refused(refused, monkeypatch):
    monkeypatch.setattr("sys.stdin", open_terminal := _Terminal())
    monkeypatch.setattr("sys.stdout", open_terminal)
    assert "needs a terminal" in refused("teleop")


@pytest.mark.slow
def test_in_a_real_terminal(terminal):
    screen = terminal(sys.executable, "-m", "nxtdrive", "teleop", "--nxt", "sim://", "--target", "lena")
    screen.wait("at rest")
    screen.wait("driving", "Up")
    screen.wait("at rest")
    screen.wait("driving", "a")
    screen.keys("Space")
    shown = screen.wait("EMERGENCY")
    assert "lena" in shown
    assert "mm" in shown
    screen.keys("Escape")
    screen.wait_for_the_end()
