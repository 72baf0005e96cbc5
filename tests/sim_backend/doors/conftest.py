"""A simulated brick served in real time from a thread, as the command line serves it."""

import contextlib
import threading
import time
from types import SimpleNamespace

import pytest

from sim_backend.doors.pty import PtyDoor
from sim_backend.doors.server import RealTimeServer
from sim_backend.simulation import SimLink, Simulation


@pytest.fixture
def served(tmp_path):
    """A brick behind the port `path`; everything is closed in the end."""
    simulation = Simulation("open")
    stop = threading.Event()
    with contextlib.closing(PtyDoor(tmp_path / "nxt", now=time.monotonic)) as door:
        link = SimLink(simulation)
        server = RealTimeServer(simulation, link, door, now=time.monotonic, sleep=door.wait)
        thread = threading.Thread(target=server.run, args=(stop.is_set, lambda status: None))
        thread.start()
        try:
            yield SimpleNamespace(path=str(door.path), simulation=simulation)
        finally:
            stop.set()
            thread.join()
