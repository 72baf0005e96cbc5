"""A brick in the simulator: an empty room with a wall far ahead, unless a test says otherwise."""

import contextlib
import os
import tomllib
from collections import deque
from pathlib import Path

import pytest

from firmware_protocol.status import Status
from nxtdrive.brick import Brick
from nxtdrive.transports import pairing
from nxtdrive.transports.base import WallClock
from nxtdrive.transports.sim import SimTransport
from sim_backend.firmware.brick import SimBrick
from sim_backend.simulation import Simulation
from sim_backend.world.loading import parse_world
from tests.nxtdrive.lockstep import Lockstep, LockstepTransport

ROOM = """
[floor]
size_mm = [6000, 3000]
[robot]
start_mm = [1000, 1500]
"""


class Lab:
    """A simulation, a brick over a link to it, and what the brick does really.

    Attributes:
        simulation: The world.
        brick: The driver's end.
    """

    def __init__(self, simulation, brick):
        self.simulation = simulation
        self.brick = brick

    def idle(self, duration_s):
        """Let time pass while the program does something that has nothing to do with the brick."""
        lockstep = getattr(self.brick.link.transport, "lockstep", None)
        if lockstep is None:
            self.simulation.advance(round(duration_s * 1000))
        else:
            lockstep.block(lambda: False, duration_s)

    def output(self, port):
        """The firmware's view of a motor."""
        return self.simulation.brick.output.outputs["ABC".index(port)].control

    def hang_bus(self):
        """Let every I2C transaction that begins from now on last for ever."""
        bus = self.simulation.brick.low_speed
        bus.status = lambda port: Status.PENDING
        bus.write = lambda port, data, rx_size, options=0: True

    def attach(self, port, plant):
        """Plug something into a motor port (a letter) or a sensor port (a number)."""
        target = self.simulation.brick
        (target.attach_motor if isinstance(port, str) else target.attach_sensor)(port, plant)
        return plant


@pytest.fixture
def way():
    """How the link is driven: stepped by the program, as in the simulator. Modules that try both ways override this."""
    return "stepped"


@pytest.fixture
def lab(way):
    """Makes labs; `extra` is TOML added to the room, `faults` a `LinkFaults`."""
    with contextlib.ExitStack() as stack:

        def make(extra="", *, latency_ms=2, faults=None, firmware="1.29", seed=0, timeout_s=1.0):
            world = parse_world(tomllib.loads(ROOM + extra), Path("room.toml"))
            simulation = Simulation(world, firmware=firmware, seed=seed)
            if way == "threaded":
                threads = Lockstep(simulation)
                transport = LockstepTransport(threads, latency_ms=latency_ms, faults=faults)
                return Lab(simulation, stack.enter_context(Brick(transport, timeout_s=timeout_s, threads=threads)))
            transport = SimTransport(simulation, latency_ms=latency_ms, faults=faults)
            return Lab(simulation, stack.enter_context(Brick(transport, timeout_s=timeout_s)))

        yield make


class DirectTransport(WallClock):
    """A brick without any way between: its replies are there at once, on the wall clock.

    Attributes:
        sent: All telegrams.
        on_send: Called with each.
        closed: Whether it was closed.
    """

    address = "direct://"
    max_telegram = 64

    def __init__(self):
        self.brick = SimBrick()
        self.sent = []
        self.on_send = lambda telegram: None
        self.closed = False
        self._replies = deque()

    def send(self, telegram):
        self.sent.append(telegram)
        self.on_send(telegram)
        reply = self.brick.receive(telegram)
        self.brick.tick()
        if reply is not None:
            self._replies.append(reply)

    def receive(self, timeout_s):
        return self._replies.popleft() if self._replies else None

    def waiting(self):
        return bool(self._replies)

    def close(self):
        self.closed = True


@pytest.fixture
def bluetoothctl(tmp_path, monkeypatch):
    """Puts a shell script into the place of BlueZ's command, on a computer with a Bluetooth adapter."""
    adapters, programs = tmp_path / "adapters", tmp_path / "programs"
    (adapters / "hci0").mkdir(parents=True)
    programs.mkdir()
    monkeypatch.setattr(pairing, "ADAPTERS", adapters)
    monkeypatch.setenv("PATH", str(programs), prepend=os.pathsep)

    def make(script):
        command = programs / "bluetoothctl"
        command.write_text(f"#!/bin/sh\n{script}\n")
        command.chmod(0o755)

    return make


@pytest.fixture
def direct():
    """A transport straight into a simulated brick, on the wall clock."""
    return DirectTransport()
