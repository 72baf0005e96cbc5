"""Servers of one robot as the tests of its page use them, and the messages that a page gets from them."""

from __future__ import annotations

import json
from collections.abc import Callable
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


def told(page: WebSocketTestSession, kind: str, /, **values: object) -> dict[str, Any]:
    """Return the next message of a kind with these values, or its record's; True stands for any that is true."""

    def wanted(message: dict[str, Any]) -> bool:
        has = message.get("record", message)
        return message["type"] == kind and all(
            bool(has.get(key)) if value is True else has.get(key) == value for key, value in values.items()
        )

    return next_message(page, wanted)


def refusal(page: WebSocketTestSession) -> str:
    """Return why the next message that is refused is refused."""
    return str(told(page, "refused")["text"])
