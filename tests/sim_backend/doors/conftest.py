"""Simulated bricks behind doors: served in real time by a thread, or turn by turn on a clock of the test's own."""

import contextlib
import select
import socket
import threading
import time
from types import SimpleNamespace

import pytest

from sim_backend.doors.pty import PtyDoor
from sim_backend.doors.server import RealTimeServer
from sim_backend.doors.sockets import NxtServerClient, PacketClient, SocketDoor, StreamClient, UsbDoor
from sim_backend.doors.switchboard import Switchboard
from sim_backend.link import LinkFaults, SimLink
from sim_backend.simulation import Simulation

TURNS = 3000
"""Enough for anything to get through; a turn is a millisecond."""


class Wall:
    """A wall clock that stands still but for waiting, which takes `extra_s` longer than asked."""

    def __init__(self):
        self.now_s = 100.0
        self.extra_s = 0.0

    def now(self):
        return self.now_s

    def wait(self, files, duration_s):
        self.now_s += duration_s + self.extra_s


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def served(tmp_path):
    """A brick behind the port `path`, in real time; everything is closed in the end."""
    simulation = Simulation("open")
    stop = threading.Event()

    def wait(files, duration_s):
        select.select(files, [], [], max(0.0, duration_s))

    with (
        contextlib.closing(PtyDoor(tmp_path / "nxt", now=time.monotonic)) as door,
        contextlib.closing(Switchboard([door], lambda bluetooth: SimLink(simulation, bluetooth=bluetooth))) as board,
    ):
        server = RealTimeServer(simulation, board, now=time.monotonic, wait=wait)
        thread = threading.Thread(target=server.run, args=(stop.is_set, lambda status: None))
        thread.start()
        try:
            yield SimpleNamespace(path=str(door.path), simulation=simulation)
        finally:
            stop.set()
            thread.join()


class House:
    """A brick with any doors, turned by hand; each turn is a millisecond of simulated time."""

    SERIAL_NUMBER = "001653010203"

    def __init__(self, stack, wall, folder):
        self.wall, self.simulation, self.events = wall, Simulation("open"), []
        self.faults = LinkFaults()
        self.folder, self._stack, self.doors = folder, stack, []
        self.board = Switchboard(self.doors, self._plug_in, self.events.append)
        self.server = RealTimeServer(self.simulation, self.board, now=wall.now, wait=wall.wait)
        stack.callback(self.board.close)

    def _plug_in(self, bluetooth):
        return SimLink(self.simulation, faults=self.faults, bluetooth=bluetooth)

    def add(self, kind):
        """A new door: pty, tcp, nxt-server, packets or usb."""
        now = self.wall.now
        if kind == "pty":
            door = PtyDoor(self.folder / f"nxt{len(self.doors)}", now=now)
        elif kind == "usb":
            door = UsbDoor(self.SERIAL_NUMBER, now=now)
        else:
            dialect = {"tcp": StreamClient, "nxt-server": NxtServerClient, "packets": PacketClient}[kind]
            door = SocketDoor(dialect, now=now)
        self._stack.callback(door.close)
        self.doors.append(door)
        return door

    def connect(self, door):
        """A program's connection to a TCP door."""
        line = socket.create_connection(("127.0.0.1", door.port), timeout=10)
        # the kernel's own delays would be none on the clock of the test
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._stack.callback(line.close)
        return line

    def turn(self, turns=1):
        for _ in range(turns):
            self.wall.now_s += 0.001
            self.server.turn()

    def until(self, condition):
        """Turn until it holds, but not forever; whether it does."""
        return any(condition() or self.turn() for _ in range(TURNS)) or condition()

    def receive(self, line, size=1):
        """Read at least this many bytes from a socket, or fewer if it is closed."""
        received = b""

        def enough():
            nonlocal received
            if select.select([line], [], [], 0)[0]:
                data = line.recv(4096)
                received += data
                return len(received) >= size or not data
            return False

        assert self.until(enough), f"only {received.hex(' ')} came"
        return received


@pytest.fixture
def house(wall, tmp_path):
    with contextlib.ExitStack() as stack:
        house = House(stack, wall, tmp_path)
        yield house
        assert not house.server.failures
