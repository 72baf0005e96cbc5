"""Clients of every kind do not affect the robot: its loop and its missions stay the same to the byte."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from nxtdrive.tools.web.app import Server, serve
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.page_socket import MAX_CLIENTS
from nxtdrive.tools.web.robot import Robot
from tests.tools.web.pages import HANDSHAKE, client_of, server_of

pytestmark = pytest.mark.slow

MISSION = '[mission]\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'
STEPS = 300
CLIENTS = 200
TEXT_FRAME = 0x81
RESET = struct.pack("ii", 1, 0)
"""SO_LINGER on, 0 seconds: closing tears the connection."""


class Witness(Hub):
    """A hub that keeps the robot's time of each step of its loop, and knows when a mission has ended."""

    def __init__(self) -> None:
        super().__init__()
        self.robot: Robot
        self.steps: list[float] = []
        self.stepped, self.ended = threading.Event(), threading.Event()
        self._crowded = threading.Event()

    def show(self, kind: str, values: Any) -> None:
        if kind == "state":
            self.steps.append(self.robot.time_s)
            if len(self.steps) == 1:
                self._crowded.wait()  # so that all steps but the first have the crowd
            if len(self.steps) >= STEPS:
                self.stepped.set()
        super().show(kind, values)

    def go(self) -> None:
        """Let the robot's loop go on."""
        self._crowded.set()

    def publish(self, kind: str, values: Any) -> None:
        super().publish(kind, values)
        if kind == "ended":
            self.ended.set()


def _server(folder: Path, hub: Witness) -> Server:
    server = server_of(folder, "sim://open?pace=fast", hub=hub)
    hub.robot = server.robot
    return server


@contextmanager
def _serving(folder: Path, hub: Witness) -> Iterator[int]:
    """Serve over real sockets; yields the port."""
    server = _server(folder, hub)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        ready = threading.Event()
        thread = threading.Thread(target=serve, args=(server, hub.robot, listener, ready.set))
        thread.start()
        try:
            ready.wait()
            yield listener.getsockname()[1]
        finally:
            hub.go()
            hub.robot.close()
            thread.join()


def _connect(port: int) -> tuple[socket.socket, bool]:
    """Open a WebSocket and never read again; returns also whether the server admitted it."""
    client = socket.create_connection(("127.0.0.1", port))
    client.sendall(HANDSHAKE.format(port=port).encode())
    received = b""
    while not received.partition(b"\r\n\r\n")[2]:
        received += client.recv(4096)
    return client, received.partition(b"\r\n\r\n")[2][0] == TEXT_FRAME


def test_the_robots_loop_keeps_its_period_whatever_the_clients_do(tmp_path):
    """200 clients, most of which the limit refuses; none reads, and half are torn off."""
    alone = Witness()
    with _serving(tmp_path, alone):
        alone.go()
        assert alone.stepped.wait(60)
    crowded = Witness()
    with _serving(tmp_path, crowded) as port, ExitStack() as open_:
        clients = [_connect(port) for _ in range(CLIENTS)]
        for client, _ in clients:
            open_.enter_context(client)
        assert sum(admitted for _, admitted in clients) == MAX_CLIENTS
        crowded.go()
        for client, _ in clients[::2]:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
            client.close()
        assert crowded.stepped.wait(60)
    assert crowded.steps[:STEPS] == alone.steps[:STEPS]


@pytest.mark.nightly
def test_watchers_do_not_change_a_mission(tmp_path):
    journals = []
    for watchers in (0, 3):
        hub, folder = Witness(), tmp_path / str(watchers)
        folder.mkdir()
        (folder / "quick.toml").write_text(MISSION, encoding="utf-8")
        server = _server(folder, hub)
        client = client_of(server)
        server.robot.start_mission(server.missions.load("quick.toml"), confirm=False)
        with ExitStack() as pages:
            for _ in range(watchers):
                page = pages.enter_context(client.websocket_connect("/ws"))
                assert page.receive_json()["type"] == "hello"
            hub.go()
            with closing(server.robot):
                server.robot.open()
                assert hub.ended.wait(120)
        (journal,) = (folder / "runs").glob("*/journal.jsonl")
        journals.append(journal.read_bytes())
    assert journals[0] == journals[1]
    assert len(journals[0]) > 1000
