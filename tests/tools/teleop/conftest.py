"""A robot in a simulated room, to drive by hand; a real terminal, and a virtual SDL gamepad."""

import contextlib
import ctypes
import importlib
import shutil
import subprocess
import threading
import tomllib
import uuid
from pathlib import Path

import pytest

from nxtdrive.brick import Brick
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation
from sim_backend.world.loading import parse_world
from tests.tools.teleop.on_screen import PATIENCE

ROOM = """
[floor]
size_mm = [4000, 3000]
[robot]
start_mm = [1000, 1500]
"""


@pytest.fixture
def room():
    """Makes (simulation, brick); a real second lasts a second if `realtime`."""
    with contextlib.ExitStack() as stack:

        def make(*, latency_ms=2, realtime=False, extra=""):
            simulation = Simulation(parse_world(tomllib.loads(ROOM + extra), Path("room.toml")))
            transport = SimTransport(simulation, latency_ms=latency_ms, realtime=realtime)
            return simulation, stack.enter_context(Brick(transport))

        yield make


class Tmux:
    """A real terminal that shows a program."""

    def __init__(self, *command):
        self._name = f"nxtdrive-{uuid.uuid4().hex}"
        self._call("new-session", "-d", "-x", "110", "-y", "32", *command)

    def _call(self, *words):
        done = subprocess.run(
            ["tmux", "-L", self._name, *words], capture_output=True, text=True, check=False, timeout=20
        )
        return done.stdout

    def keys(self, *keys):
        self._call("send-keys", *keys)

    def screen(self):
        return self._call("capture-pane", "-p")

    def wait(self, text, *keys):
        """Until the screen shows `text`; presses keys meanwhile."""
        for _ in range(PATIENCE):
            screen = self.screen()
            if text in screen:
                return screen
            if keys:
                self.keys(*keys)
            threading.Event().wait(0.05)
        raise AssertionError(f"{text!r} never came:\n{screen}")

    def wait_for_the_end(self):
        for _ in range(PATIENCE):
            if not self._call("list-sessions"):
                return
            threading.Event().wait(0.05)
        raise AssertionError(f"it goes on:\n{self.screen()}")

    def close(self):
        self._call("kill-server")


@pytest.fixture
def terminal():
    """Runs a command in a real terminal."""
    if shutil.which("tmux") is None:
        pytest.skip("no tmux on this computer: no real terminal to try")
    with contextlib.ExitStack() as stack:

        def run(*command):
            return stack.enter_context(contextlib.closing(Tmux(*command)))

        yield run


class VirtualGamepad:
    """A gamepad that SDL believes in: SDL_JoystickAttachVirtual of the very library pygame has loaded."""

    GAMECONTROLLER, AXES, BUTTONS = 1, 6, 15

    def __init__(self, sdl):
        self._sdl = sdl
        self._instance = None

    def plug(self, kind=GAMECONTROLLER):
        index = self._sdl.SDL_JoystickAttachVirtual(kind, self.AXES, self.BUTTONS, 0)
        assert index >= 0
        self._instance = self._sdl.SDL_JoystickGetDeviceInstanceID(index)

    def unplug(self):
        for index in range(self._sdl.SDL_NumJoysticks()):
            if self._sdl.SDL_JoystickGetDeviceInstanceID(index) == self._instance:
                assert self._sdl.SDL_JoystickDetachVirtual(index) == 0
        self._instance = None

    def _joystick(self):
        """As the program that has opened it sees it; only then can it be moved."""
        joystick = self._sdl.SDL_JoystickFromInstanceID(self._instance)
        assert joystick, "no program has opened the gamepad"
        return ctypes.c_void_p(joystick)

    def move(self, axis, part):
        assert self._sdl.SDL_JoystickSetVirtualAxis(self._joystick(), axis, ctypes.c_int16(round(32767 * part))) == 0

    def press(self, button, down=True):
        assert self._sdl.SDL_JoystickSetVirtualButton(self._joystick(), button, int(down)) == 0


@pytest.fixture
def pad():
    """A `Gamepad` that reads, with a virtual gamepad that is not yet plugged in: (gamepad, virtual)."""
    pytest.importorskip("pygame", reason="pygame-ce is not installed (pip install 'nxtdrive[gamepad]')")
    from nxtdrive.tools.teleop.gamepad import Gamepad

    with contextlib.closing(Gamepad()) as gamepad:
        virtual = VirtualGamepad(_sdl_of_pygame())
        yield gamepad, virtual
        virtual.unplug()


def _sdl_of_pygame():
    """Symbols of the library that pygame is linked with are found through pygame's own module, wherever it lies."""
    sdl = ctypes.CDLL(importlib.import_module("pygame.base").__file__)
    if not hasattr(sdl, "SDL_JoystickAttachVirtual"):
        pytest.skip("this SDL's functions cannot be reached on this system")
    sdl.SDL_JoystickFromInstanceID.restype = ctypes.c_void_p
    return sdl
