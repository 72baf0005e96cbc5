"""A robot in a simulated room, for hands to drive."""

import contextlib
import tomllib
from pathlib import Path

import pytest

from nxtdrive.brick import Brick
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation
from sim_backend.world.loading import parse_world

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
