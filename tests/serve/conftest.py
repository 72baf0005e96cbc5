"""A line server in a thread, over a simulated brick, with clients on real sockets.

Simulated time passes only while a command runs. What shall happen meanwhile is put on the simulation's agenda and runs
in the server's thread; between commands the server only listens, and a test may look at the world and let it go on.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.ports import Vision
from nxtdrive.brick import Brick
from nxtdrive.mission.camera import open_mission_camera
from nxtdrive.mission.line_server import LineServer, sessions
from nxtdrive.mission.vision import camera_vision, geometric_vision
from nxtdrive.transports.sim import SimTransport
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

AT_REST_MM_S = 1.0


class Client:
    """A program that speaks the line protocol."""

    def __init__(self, address: tuple[str, int]) -> None:
        self.socket = socket.create_connection(address, timeout=20)
        self._replies = self.socket.makefile("rb")

    def send(self, text: str) -> None:
        """Send text as it is."""
        self.socket.sendall(text.encode())

    def receive(self) -> bytes:
        """The next line, without its end; empty when the connection is closed."""
        return self._replies.readline().rstrip(b"\n")

    def ask(self, line: str) -> int:
        """Send a line and wait for its answer."""
        self.send(line + "\n")
        return int(self.receive())

    def leave(self) -> None:
        """Close the connection."""
        self._replies.close()
        self.socket.close()


@dataclass
class Served:
    """A server that runs, and the world behind it."""

    simulation: Simulation
    server: LineServer
    end: threading.Event
    thread: threading.Thread
    records: list[Record]
    said: list[str]
    clients: list[Client] = field(default_factory=list)

    def client(self) -> Client:
        """Another client."""
        self.clients.append(Client(self.server.address))
        return self.clients[-1]

    def after(self, duration_s: float, action: Callable[[], object]) -> None:
        """Have something happen in the midst of the next command."""
        self.simulation.at(self.simulation.now_ms + round(duration_s * 1000), action)

    @property
    def at_rest(self) -> bool:
        """Whether the robot stands still, half a second from now; only while no command runs."""
        self.simulation.advance(500)
        return self.simulation.truth.speed_mm_s < AT_REST_MM_S

    @property
    def dialogue(self) -> list[tuple[str, int]]:
        """What was asked and answered, as the server tells it."""
        return [
            (f"{record.data['verb']} {record.data['argument']}".rstrip(), record.data["value"])
            for record in self.records
            if record.kind is RecordKind.REPLY
        ]


@contextlib.contextmanager
def serving(
    brick: Brick,
    simulation: Simulation,
    mission: Mission,
    vision: Vision,
    passing: Callable[[float], None] | None = None,
) -> Iterator[Served]:
    """Serve a brick until the block is left."""
    records: list[Record] = []
    said: list[str] = []
    end = threading.Event()
    server = LineServer(
        brick,
        sessions(mission, brick, vision, [records.append]),
        port=0,
        stopped=end.is_set,
        say=said.append,
        passing=passing,
    )
    served = Served(simulation, server, end, threading.Thread(target=server.run), records, said)
    served.thread.start()
    try:
        yield served
    finally:
        end.set()
        served.thread.join()
        server.close()
        for client in served.clients:
            client.leave()


@pytest.fixture
def serve(mission_for: Callable[..., Mission]) -> Iterator[Callable[..., Served]]:
    """Serves simulated bricks in bundled worlds."""
    with contextlib.ExitStack() as stack:

        def _serve(
            world: str = "open",
            *targets: str,
            camera: bool = False,
            faults: LinkFaults | None = None,
            **thesis: object,
        ) -> Served:
            simulation = Simulation(world, seed=1)
            mission = mission_for(*(targets or ("lena", "rilakkuma")), **thesis)
            brick = stack.enter_context(Brick(SimTransport(simulation, faults=faults)))
            vision: Vision = geometric_vision(brick, mission)
            if camera:
                vision = camera_vision(open_mission_camera("sim", brick), mission)
            return stack.enter_context(serving(brick, simulation, mission, vision))

        yield _serve


@pytest.fixture(name="serving")
def _serving() -> Callable[..., contextlib.AbstractContextManager[Served]]:
    return serving
