"""Simulated bricks for third-party programs, which run unmodified in processes of their own."""

import contextlib
import os
import select
import subprocess
import sys
import threading
import time
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import pytest

from nxtdrive.cli.commands.sim_exec import environment
from sim_backend.doors.pty import PtyDoor
from sim_backend.doors.server import RealTimeServer
from sim_backend.doors.sockets import NxtServerClient, SocketDoor, UsbDoor
from sim_backend.doors.switchboard import Switchboard
from sim_backend.link import SimLink
from sim_backend.simulation import Simulation

PATIENCE_S = 60
SERIAL_NUMBER = "001653010203"
LATENCY_MS = 1.0


class Plug:
    """One way for nxt-python to reach the simulated brick.

    Attributes:
        backend: nxt-python's name of it.
        keywords: What nxt-python's `find` takes for it.
        options: The same for its command line programs.
        environ: The environment of the programs.
    """

    def __init__(self, backend, keywords=(), environ=None):
        self.backend = backend
        self.keywords = {name: str(value) for name, value in dict(keywords).items()}
        words = [[f"--{name.replace('_', '-')}", value] for name, value in self.keywords.items()]
        self.options = ["--backend", backend, *chain.from_iterable(words)]
        self.environ = environ

    def run(self, *command):
        """What a program prints; it must end well."""
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
            stdin=subprocess.DEVNULL,
            env=self.environ,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def tool(self, name, *words):
        """Run one of nxt-python's own programs."""
        return self.run(Path(sys.executable).with_name(name), *self.options, *words)

    def script(self, text):
        """Run a program that finds its brick by ``nxt.locator.find(**where)``."""
        where = {"backends": [self.backend], **self.keywords}
        return self.run(sys.executable, "-c", f"where = {where!r}\n{text}")


def _pty(folder):
    door = PtyDoor(folder / "nxt", now=time.monotonic)
    return door, Plug("devfile", {"filename": door.path})


def _nxt_server(_):
    door = SocketDoor(NxtServerClient, now=time.monotonic)
    return door, Plug("socket", {"server_host": "127.0.0.1", "server_port": door.port})


def _usb(_):
    door = UsbDoor(SERIAL_NUMBER, now=time.monotonic)
    return door, Plug("usb", environ=environment(os.environ, door.port, SERIAL_NUMBER))


PLUGS = {"pty": _pty, "nxt-server": _nxt_server, "usb": _usb}


class Rig:
    """A simulated brick in real time.

    Attributes:
        plug: How nxt-python reaches it.
    """

    def __init__(self, plug, simulation, switchboard):
        self.plug, self._simulation = plug, simulation
        self._turning = threading.Lock()
        self._server = RealTimeServer(simulation, switchboard, now=time.monotonic, wait=self._wait)

    def _wait(self, files, duration_s):
        self._turning.release()
        try:
            select.select(files, [], [], duration_s)
        finally:
            self._turning.acquire()

    @contextlib.contextmanager
    def serving(self):
        """Serve from a thread."""
        stop = threading.Event()

        def run():
            with self._turning:
                self._server.run(stop.is_set, lambda status: None)

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join()

    @contextlib.contextmanager
    def halted(self):
        """The simulation, while its time stands still."""
        with self._turning:
            yield self._simulation


@pytest.fixture(params=PLUGS)
def rig(request, tmp_path):
    if find_spec("nxt") is None:
        pytest.skip("nxt-python is not installed (pip install .[test])")
    simulation = Simulation("open")

    def plug_in(bluetooth):
        return SimLink(simulation, LATENCY_MS, bluetooth=bluetooth)

    door, plug = PLUGS[request.param](tmp_path)
    with contextlib.closing(door), contextlib.closing(Switchboard([door], plug_in)) as board:
        made = Rig(plug, simulation, board)
        with made.serving():
            yield made
