"""Servers of one robot as the tests of its page use them, and the messages that a page gets from them."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient, WebSocketTestSession

from behaviors.mission import Mission
from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.web.app import Server
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.missions import Missions
from nxtdrive.tools.web.robot import Robot
from nxtdrive.tools.web.runs import Runs
from nxtdrive.transports.address import Address

HOST = {"host": "127.0.0.1:7080"}
HANDSHAKE = (
    "GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


class ToldHub(Hub):
    """A hub that calls a function with the kind and the values of all that it sends."""

    def __init__(self, tell: Callable[[str, Mapping[str, Any]], object]) -> None:
        super().__init__()
        self._tell = tell

    def show(self, kind: str, values: Mapping[str, Any]) -> None:
        super().show(kind, values)
        self._tell(kind, values)

    def publish(self, kind: str, values: Mapping[str, Any]) -> None:
        super().publish(kind, values)
        self._tell(kind, values)


def hub_setting(event: threading.Event, kind: str, /, **values: object) -> Hub:
    """Return a hub that sets an event when it sends something of that kind with these values, as for `told`."""
    return ToldHub(lambda sent, having: event.set() if sent == kind and _has(having, values) else None)


def robot_of(
    runs: Path,
    hub: Hub,
    address: str = "sim://empty?pace=fast",
    camera: str | None = None,
    mission: Mission | None = None,
) -> Robot:
    """Return a robot that is not open, built as a mission says; by default as the built-in one does."""
    return Robot(Address.parse(address), camera, mission or read_mission_file(None), hub, runs)


def server_of(
    folder: Path, address: str = "sim://open", camera: str | None = None, *, hub: Hub | None = None, **more: Any
) -> Server:
    """Return the server of such a robot: the missions are those of the folder, and the runs are below it."""
    hub, runs = hub or Hub(), folder / "runs"
    return Server(robot_of(runs, hub, address, camera), hub, Missions(folder), Runs(runs), address, **more)


def client_of(server: Server) -> TestClient:
    """Return a browser on this computer; it raises what the server's own code raises."""
    return TestClient(server.app(), headers=HOST)


def next_message(page: WebSocketTestSession, wanted: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    """Return the next JSON message that is wanted."""
    while True:
        text = page.receive().get("text")
        if text and wanted(message := json.loads(text)):
            return message


def _has(message: Mapping[str, Any], values: Mapping[str, object]) -> bool:
    return all(bool(message.get(key)) if value is True else message.get(key) == value for key, value in values.items())


def told(page: WebSocketTestSession, kind: str, /, **values: object) -> dict[str, Any]:
    """Return the next message of a kind with these values, or its record's; True stands for any that is true."""
    return next_message(page, lambda message: message["type"] == kind and _has(message.get("record", message), values))


def refusal(page: WebSocketTestSession) -> str:
    """Return why the next message that is refused is refused."""
    return str(told(page, "refused")["text"])
